from bridges.runtime.inbox import INBOX_SIZE, Inbox


def test_an_inbox_gives_each_device_its_messages_in_order() -> None:
    inbox: Inbox[int] = Inbox()
    for name, number in (("A", 1), ("B", 2), ("A", 3)):
        inbox.put(name, number)
    assert inbox.take() == {"A": [1, 3], "B": [2]}
    assert inbox.take() == {}


def test_a_flood_drops_the_oldest_and_counts_them() -> None:
    inbox: Inbox[int] = Inbox()
    for number in range(INBOX_SIZE + 3):
        inbox.put("A", number)
    kept = inbox.take()["A"]
    assert (kept[0], kept[-1], len(kept)) == (3, INBOX_SIZE + 2, INBOX_SIZE)
    assert inbox.dropped == 3


def test_the_newest_message_of_a_sender_replaces_its_older_ones() -> None:
    inbox: Inbox[str] = Inbox()
    for event, sender in (("OPEN by a", "a"), ("OPEN by b", "b"), ("CLOSE by a", "a")):
        inbox.put("A", event, sender)
    assert inbox.take() == {"A": ["OPEN by b", "CLOSE by a"]}
    assert inbox.dropped == 0


def test_the_bell_rings_once_for_many_messages_and_again_for_the_next() -> None:
    inbox: Inbox[int] = Inbox()
    inbox.put("A", 1)
    inbox.put("A", 2)
    assert inbox.wait(0) is True
    assert inbox.wait(0) is False
    inbox.wake()
    assert inbox.wait(0) is True
