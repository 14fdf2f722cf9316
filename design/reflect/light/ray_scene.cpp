// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/ray_scene.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <limits>

#include "core/error.h"

namespace lensforge::reflect {

/// Owns Embree's objects. A device that is told how many threads to use keeps the whole process to
/// as many for as long as it lives, so that this one is told nothing.
struct RayScene::Handles {
  Handles() : device(rtcNewDevice(nullptr)), scene(rtcNewScene(device)) {
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  }
  ~Handles() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;

  RTCDevice device;
  RTCScene scene;
};

namespace {

void copy_triangles(const SurfaceMesh& mesh, RTCGeometry geometry) {
  const auto vertices = static_cast<std::size_t>(mesh.vertex_count());
  const auto triangles = static_cast<std::size_t>(mesh.triangle_count());
  auto* xyz = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices));
  auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), triangles));
  if (xyz == nullptr || corners == nullptr) throw RunError("not enough memory for Embree's mesh");
  std::transform(mesh.vertices.data(), mesh.vertices.data() + mesh.vertices.size(), xyz,
                 [](double x) { return static_cast<float>(x); });
  std::transform(mesh.triangles.data(), mesh.triangles.data() + mesh.triangles.size(), corners,
                 [](int v) { return static_cast<unsigned>(v); });
}

RTCRay ray_from(const Eigen::Vector3d& p, const Eigen::Vector3d& w, double reach) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(p.x());
  ray.org_y = static_cast<float>(p.y());
  ray.org_z = static_cast<float>(p.z());
  ray.dir_x = static_cast<float>(w.x());
  ray.dir_y = static_cast<float>(w.y());
  ray.dir_z = static_cast<float>(w.z());
  ray.tfar = static_cast<float>(reach);
  ray.mask = ~0U;
  return ray;
}

}  // namespace

RayScene::RayScene(const SurfaceMesh& mesh) {
  const auto handles = std::make_shared<Handles>();
  RTCGeometry geometry = rtcNewGeometry(handles->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  copy_triangles(mesh, geometry);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(handles->scene, geometry);
  rtcReleaseGeometry(geometry);
  // One thread builds the tree, so that it is the same every time.
  tbb::task_arena(1).execute([&] { rtcCommitScene(handles->scene); });
  handles_ = handles;
  const Eigen::Vector3d size =
      mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
  offset_ = kRayOffset * size.norm();
}

RayHit RayScene::nearest(const Eigen::Vector3d& p, const Eigen::Vector3d& w) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = ray_from(p, w, std::numeric_limits<double>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(handles_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {static_cast<int>(query.hit.primID), static_cast<double>(query.ray.tfar)};
}

bool RayScene::blocked(const Eigen::Vector3d& p, const Eigen::Vector3d& w, double reach) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = ray_from(p, w, reach);
  rtcOccluded1(handles_->scene, &context, &ray);
  return ray.tfar < 0.0F;
}

}  // namespace lensforge::reflect
