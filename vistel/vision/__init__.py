"""What cameras on a helmet see: the marks of a face and an eye. Pictures in, numbers out; no camera and no clock."""
