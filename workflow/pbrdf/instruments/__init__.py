"""What takes photographs."""
