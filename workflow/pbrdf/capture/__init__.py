"""From a plan to photographs that survive whatever happens on the way."""
