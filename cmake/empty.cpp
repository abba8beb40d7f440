// A target must have a source; those that only compile a header have this one.
