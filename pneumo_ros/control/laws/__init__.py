"""Control laws: from the tracking error of one output to the third derivative wanted of it."""
