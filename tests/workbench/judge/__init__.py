"""`judge`: nodes with the defects of the field, right ones, and ours, before the same laws."""
