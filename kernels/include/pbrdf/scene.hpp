// What one pixel of a pinhole camera sees of a lit sphere: cold algebra, a few dozen operations a ray.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <optional>

namespace pbrdf {

using Vector3 = Eigen::Vector3d;

// Lengths in millimetres, directions in the camera's frame (x right, y down, z along the view).
struct Pinhole {
  double fx, fy, cx, cy;  // pixels; the centre of the first pixel is (0, 0)
};

struct SphereScene {
  Vector3 centre;
  double radius;
  Vector3 light;
  Vector3 generator_axis;  // x axis of the generator's frame
  Vector3 analyser_axis;   // x axis of the analyser's frame
};

// A lit point of the surface. Frames: rotations from the table frames to the modules' frames.
struct SurfacePoint {
  Vector3 light_local, camera_local;  // unit vectors, z the surface normal
  double irradiance;                  // cos(theta_i) / d^2, 1/m^2
  double angle_in, angle_out;         // from s to the module's x axis, about -L and about V, rad
};

inline Vector3 transverse(const Vector3& axis, const Vector3& propagation) {
  return (axis - axis.dot(propagation) * propagation).normalized();
}

inline double angle_between(const Vector3& from, const Vector3& to, const Vector3& propagation) {
  return std::atan2(propagation.dot(from.cross(to)), from.dot(to));
}

// First intersection of the ray through (column, row) with the sphere, if that point is lit and not seen edge-on.
inline std::optional<SurfacePoint> trace(const Pinhole& camera, const SphereScene& scene, double column, double row) {
  const Vector3 ray = Vector3((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1.0).normalized();
  const double along = ray.dot(scene.centre);
  const double discriminant = along * along - scene.centre.squaredNorm() + scene.radius * scene.radius;
  if (discriminant <= 0.0) return std::nullopt;
  const Vector3 point = (along - std::sqrt(discriminant)) * ray;
  const Vector3 normal = (point - scene.centre) / scene.radius;
  const Vector3 to_light = (scene.light - point).normalized();
  const Vector3 to_camera = -ray;
  const double cos_light = normal.dot(to_light);
  if (cos_light <= 0.0 || normal.dot(to_camera) <= 0.0) return std::nullopt;

  const Vector3 tangent = transverse(std::abs(normal.x()) < 0.9 ? Vector3::UnitX() : Vector3::UnitY(), normal);
  Eigen::Matrix3d to_local;
  to_local << tangent.transpose(), normal.cross(tangent).transpose(), normal.transpose();

  SurfacePoint seen;
  seen.light_local = to_local * to_light;
  seen.camera_local = to_local * to_camera;
  seen.irradiance = cos_light / ((scene.light - point).squaredNorm() * 1e-6);
  // Where L = V the plane of incidence is undefined and the matrix is the same in every frame turned alike at both
  // ends.
  const Vector3 across = to_light.cross(to_camera);
  const Vector3 s = across.norm() > 1e-12 ? Vector3(across.normalized()) : transverse(scene.analyser_axis, to_camera);
  seen.angle_in = angle_between(s, transverse(scene.generator_axis, -to_light), -to_light);
  seen.angle_out = angle_between(s, transverse(scene.analyser_axis, to_camera), to_camera);
  return seen;
}

// R(angle_out) M R(angle_in)^T: a Mueller matrix re-expressed in turned frames.
inline Eigen::Matrix4d change_frames(const Eigen::Matrix4d& mueller, double angle_in, double angle_out) {
  const auto rotator = [](double angle) {
    const double c = std::cos(2.0 * angle), s = std::sin(2.0 * angle);
    Eigen::Matrix4d r = Eigen::Matrix4d::Identity();
    r(1, 1) = r(2, 2) = c;
    r(1, 2) = s;
    r(2, 1) = -s;
    return r;
  };
  return rotator(angle_out) * mueller * rotator(angle_in).transpose();
}

}  // namespace pbrdf
