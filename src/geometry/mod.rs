//! Plain geometry that knows nothing of light.
