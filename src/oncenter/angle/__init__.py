"""The steering wheel angle without its sensor."""
