// SPDX-License-Identifier: Apache-2.0
// Embree 3 (Debian 12) and Embree 4 (Debian 13) behind one interface. In Embree 4, the context of a
// query is part of the query's arguments.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace peeler::test {

/// Returns a single-threaded device. Test scenes are small, and ThreadSanitizer reports false races
/// in Embree's threads.
inline RTCDevice newEmbreeDevice() {
    return rtcNewDevice("threads=1");
}

/// The context that Embree passes from a query to its filters. A filter casts the context to a
/// struct that begins with it.
#if RTC_VERSION_MAJOR >= 4
using EmbreeContext = RTCRayQueryContext;
#else
using EmbreeContext = RTCIntersectContext;
#endif

enum class RayOrder { kIncoherent, kCoherent };

#if RTC_VERSION_MAJOR >= 4

inline EmbreeContext embreeContext(RayOrder) {
    EmbreeContext context;
    rtcInitRayQueryContext(&context);
    return context;
}

inline RTCIntersectArguments embreeArguments(EmbreeContext& context, RayOrder order) {
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    if (order == RayOrder::kCoherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    arguments.context = &context;
    return arguments;
}

inline void intersect1(RTCScene scene, EmbreeContext& context, RayOrder order, RTCRayHit* ray) {
    RTCIntersectArguments arguments = embreeArguments(context, order);
    rtcIntersect1(scene, ray, &arguments);
}
inline void intersect8(const int* valid, RTCScene scene, EmbreeContext& context, RayOrder order,
                       RTCRayHit8* rays) {
    RTCIntersectArguments arguments = embreeArguments(context, order);
    rtcIntersect8(valid, scene, rays, &arguments);
}
inline void intersect16(const int* valid, RTCScene scene, EmbreeContext& context, RayOrder order,
                        RTCRayHit16* rays) {
    RTCIntersectArguments arguments = embreeArguments(context, order);
    rtcIntersect16(valid, scene, rays, &arguments);
}
inline void occluded1(RTCScene scene, RTCRay* ray) {
    rtcOccluded1(scene, ray, nullptr);
}

#else

inline EmbreeContext embreeContext(RayOrder order) {
    EmbreeContext context;
    rtcInitIntersectContext(&context);
    if (order == RayOrder::kCoherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    return context;
}

inline void intersect1(RTCScene scene, EmbreeContext& context, RayOrder, RTCRayHit* ray) {
    rtcIntersect1(scene, &context, ray);
}
inline void intersect8(const int* valid, RTCScene scene, EmbreeContext& context, RayOrder,
                       RTCRayHit8* rays) {
    rtcIntersect8(valid, scene, &context, rays);
}
inline void intersect16(const int* valid, RTCScene scene, EmbreeContext& context, RayOrder,
                        RTCRayHit16* rays) {
    rtcIntersect16(valid, scene, &context, rays);
}
inline void occluded1(RTCScene scene, RTCRay* ray) {
    EmbreeContext context = embreeContext(RayOrder::kIncoherent);
    rtcOccluded1(scene, &context, ray);
}

#endif

}  // namespace peeler::test
