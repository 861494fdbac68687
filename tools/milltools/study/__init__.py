"""Many runs in one table: docs/studies.md."""
