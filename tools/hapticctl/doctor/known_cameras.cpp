// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/known_cameras.h"

#include <algorithm>
#include <array>

namespace hapticd::tools {
namespace {

constexpr const char* kDepthByVendor =
    "it delivers infrared images, and its vendor's software computes the depth";
constexpr const char* kOwnProtocol = "it is not a video device: its vendor's software talks to it";
constexpr const char* kTwoViews =
    "it delivers two colour images, and its vendor's software computes the depth";
constexpr const char* kLibfreenect2 = "it needs libfreenect2, which hapticd does not use";

// Ids of RealSense: librealsense, src/ds/d400/d400-private.h; of Orbbec: OrbbecSDK_v2; of the others: the
// udev rules of their vendors' software.
constexpr std::array<KnownCamera, 26> kCameras{{
    {0x8086, 0x0ad1, "Intel RealSense D400", ""},
    {0x8086, 0x0ad2, "Intel RealSense D410", ""},
    {0x8086, 0x0ad3, "Intel RealSense D415", ""},
    {0x8086, 0x0ad4, "Intel RealSense D430", ""},
    {0x8086, 0x0b07, "Intel RealSense D435", ""},
    {0x8086, 0x0b3a, "Intel RealSense D435i", ""},
    {0x8086, 0x0b5b, "Intel RealSense D405", ""},
    {0x8086, 0x0b5c, "Intel RealSense D455", ""},
    {0x8086, 0x1155, "Intel RealSense D421", ""},
    {0x8086, 0x1156, "Intel RealSense D436", ""},
    {0x2bc5, 0x0800, "Orbbec Gemini 335", ""},
    {0x2bc5, 0x0801, "Orbbec Gemini 330", ""},
    {0x2bc5, 0x0803, "Orbbec Gemini 336", ""},
    {0x2bc5, 0x0804, "Orbbec Gemini 335L", ""},
    {0x2bc5, 0x0807, "Orbbec Gemini 336L", ""},
    {0x2bc5, 0x0669, "Orbbec Femto Mega", ""},
    {0x2bc5, 0x066b, "Orbbec Femto Bolt", kDepthByVendor},
    {0x045e, 0x097c, "Azure Kinect", kDepthByVendor},
    {0x045e, 0x097d, "Azure Kinect, colour camera", "it delivers no depth"},
    {0x045e, 0x02c4, "Kinect v2", kLibfreenect2},
    {0x045e, 0x02d8, "Kinect v2", kLibfreenect2},
    {0x03e7, 0x2485, "Luxonis OAK-D", kOwnProtocol},
    {0x03e7, 0xf63b, "Luxonis OAK-D", kOwnProtocol},
    {0x03e7, 0xf63c, "Luxonis OAK-D", kOwnProtocol},
    {0x03e7, 0xf63d, "Luxonis OAK-D", kOwnProtocol},
    {0x2b03, kAnyProduct, "Stereolabs ZED", kTwoViews},
}};

}  // namespace

const KnownCamera* knownCamera(std::uint16_t vendor, std::uint16_t product) {
  const auto* const known = std::ranges::find_if(kCameras, [&](const KnownCamera& it) {
    return it.vendor == vendor && (it.product == kAnyProduct || it.product == product);
  });
  return known == kCameras.end() ? nullptr : known;
}

}  // namespace hapticd::tools
