"""Tree files, and what loads and checks them."""
