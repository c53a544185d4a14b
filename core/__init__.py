"""Photos in, a baked scene out. Knows no glTF, no USD and no HTTP."""
