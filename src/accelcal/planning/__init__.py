"""Before a test is booked: what each test would tell, how long it takes, and which one is best."""
