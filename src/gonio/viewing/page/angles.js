// Directions, as gonio has them: z is the normal, phi = 180 deg the forward half-plane, angles in degrees.

const DEGREE = Math.PI / 180;

export const cosine = (theta) => Math.cos(theta * DEGREE);

// Unit vector to the light.
export function light(thetaI, phiI = 0) {
  const s = Math.sin(thetaI * DEGREE);
  return [s * Math.cos(phiI * DEGREE), s * Math.sin(phiI * DEGREE), Math.cos(thetaI * DEGREE)];
}

// Unit vector to the detector, whose azimuth phi is counted from that of the light.
export function detector(thetaR, phi, phiI = 0) {
  return light(thetaR, phiI + phi);
}

// The same in the plane of incidence, where theta_r has a sign: positive is forward.
export function inPlane(signed, phiI = 0) {
  return detector(Math.abs(signed), signed >= 0 ? 180 : 0, phiI);
}
