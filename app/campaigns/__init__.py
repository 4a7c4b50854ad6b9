"""Many runs: what is to be done, where it is done, and the store of what has come out."""
