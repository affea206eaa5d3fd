"""What every part uses: errors, compiling, memory, the launcher, the field table."""
