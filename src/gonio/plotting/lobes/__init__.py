"""Values as lengths from a centre: in the plane of incidence on a polar axis, and over the hemisphere as a lobe."""
