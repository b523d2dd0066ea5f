"""What rems_net costs, next to what is physically possible and to its peers."""
