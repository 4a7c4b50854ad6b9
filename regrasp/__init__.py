"""Behaviour-tree autonomy that anyone can run, test and measure."""
