"""From raw frames to Mueller images in the frames of the generator and the analyser."""
