"""What a bridge can be, a folder for each kind: pure rules about lifts, doors and chargers."""
