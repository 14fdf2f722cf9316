// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/light_scene.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <limits>
#include <string>

#include "core/error.h"

namespace lensforge::bench {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kOn = -1;  ///< Embree's mark of a lane in use.

// Both tell Embree that neighbouring rays are close to each other.
#if RTC_VERSION_MAJOR >= 4
void intersect(const int* valid, RTCScene scene, RTCRayHit16& rays) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &rays, &arguments);
}
void occlude(const int* valid, RTCScene scene, RTCRay16& rays) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded16(valid, scene, &rays, &arguments);
}
#else
RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}
void intersect(const int* valid, RTCScene scene, RTCRayHit16& rays) {
  RTCIntersectContext context = coherent_context();
  rtcIntersect16(valid, scene, &context, &rays);
}
void occlude(const int* valid, RTCScene scene, RTCRay16& rays) {
  RTCIntersectContext context = coherent_context();
  rtcOccluded16(valid, scene, &context, &rays);
}
#endif

void set_ray(RTCRay16& rays, int lane, const Eigen::Vector3f& origin,
             const Eigen::Vector3f& direction, float nearest) {
  rays.org_x[lane] = origin.x();
  rays.org_y[lane] = origin.y();
  rays.org_z[lane] = origin.z();
  rays.dir_x[lane] = direction.x();
  rays.dir_y[lane] = direction.y();
  rays.dir_z[lane] = direction.z();
  rays.tnear[lane] = nearest;
  rays.tfar[lane] = kInfinity;
  rays.time[lane] = 0.0F;
  rays.mask[lane] = ~0U;
  rays.id[lane] = static_cast<unsigned>(lane);
  rays.flags[lane] = 0;
}

RTCGeometry make_geometry(RTCDevice device, const SurfaceMesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* const points = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                              3 * sizeof(float), static_cast<std::size_t>(mesh.vertex_count())));
  auto* const corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
      static_cast<std::size_t>(mesh.triangle_count())));
  if (points == nullptr || corners == nullptr) throw RunError("Embree: no memory for the mesh");
  Eigen::Map<Eigen::Matrix3Xf>(points, 3, mesh.vertices.cols()) = mesh.vertices.cast<float>();
  Eigen::Map<Eigen::Matrix<unsigned, 3, Eigen::Dynamic>>(corners, 3, mesh.triangles.cols()) =
      mesh.triangles.cast<unsigned>();
  rtcCommitGeometry(geometry);
  return geometry;
}

}  // namespace

struct LightScene::Handles {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  Handles() : device(rtcNewDevice(nullptr)) {
    if (device == nullptr) {
      throw RunError("Embree does not start: error " + std::to_string(rtcGetDeviceError(nullptr)));
    }
    scene = rtcNewScene(device);
  }
  ~Handles() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;
};

LightScene::LightScene(const SurfaceMesh& mesh) : handles_(std::make_unique<Handles>()) {
  // Robust: a ray that passes exactly between two triangles meets one of them.
  rtcSetSceneFlags(handles_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(handles_->scene, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = make_geometry(handles_->device, mesh);
  rtcAttachGeometry(handles_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(handles_->scene);
}

LightScene::~LightScene() = default;

std::array<int, kLanes> LightScene::triangles_above(const Places& places, int count) const {
  alignas(64) std::array<int, kLanes> valid{};
  alignas(64) RTCRayHit16 packet;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2f xy = places.col(i).cast<float>();
    set_ray(packet.ray, i, {xy.x(), xy.y(), 0.0F}, Eigen::Vector3f::UnitZ(), 0.0F);
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    valid[static_cast<std::size_t>(i)] = kOn;
  }
  intersect(valid.data(), handles_->scene, packet);
  std::array<int, kLanes> met{};
  for (int i = 0; i < count; ++i) {
    const bool hit = packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    met[static_cast<std::size_t>(i)] = hit ? static_cast<int>(packet.hit.primID[i]) : -1;
  }
  return met;
}

int LightScene::blocked(const RayPacket& rays) const {
  alignas(64) std::array<int, kLanes> valid{};
  alignas(64) RTCRay16 packet;
  for (int i = 0; i < rays.size; ++i) {
    const auto k = static_cast<std::size_t>(i);
    set_ray(packet, i, rays.origins[k].cast<float>(), rays.directions[k].cast<float>(), kClearance);
    valid[k] = kOn;
  }
  occlude(valid.data(), handles_->scene, packet);
  int blocked = 0;
  for (int i = 0; i < rays.size; ++i) blocked += packet.tfar[i] < 0.0F ? 1 : 0;
  return blocked;
}

}  // namespace lensforge::bench
