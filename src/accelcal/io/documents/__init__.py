"""Files of results, as JSON and as frames of a batch; one result is chosen by its serial number."""
