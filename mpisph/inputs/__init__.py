"""What reading any TOML file of ours needs: units, places, overrides, messages."""
