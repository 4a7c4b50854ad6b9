"""The training of the printed part's detector, and its evaluation."""
