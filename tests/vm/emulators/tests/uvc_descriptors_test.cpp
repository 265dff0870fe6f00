// SPDX-License-Identifier: Apache-2.0
// What the kernel reads of the emulated depth camera when it is plugged in. Offsets: USB Video Class 1.1.

#include <gtest/gtest.h>

#include <cerrno>
#include <map>

#include "tests/vm/emulators/tests/uvc_rig.h"

namespace hapticd::test {
namespace {

/// The descriptors in a configuration, one after the other; throws where one is longer than the rest.
std::vector<Bytes> taken(const Bytes& configuration) {
  std::vector<Bytes> all;
  for (std::size_t at = 0; at < configuration.size(); at += configuration.at(at)) {
    const std::size_t length = configuration[at];
    if (length < 2 || at + length > configuration.size()) throw std::runtime_error("a descriptor is cut");
    all.emplace_back(configuration.begin() + static_cast<std::ptrdiff_t>(at),
                     configuration.begin() + static_cast<std::ptrdiff_t>(at + length));
  }
  return all;
}

/// Class descriptors of a subtype behind the interface descriptor of that subclass.
std::vector<Bytes> ofClass(const std::vector<Bytes>& all, std::uint8_t subclass, std::uint8_t subtype) {
  std::vector<Bytes> found;
  std::uint8_t current = 0;
  for (const Bytes& one : all) {
    if (one[1] == 4) current = one[6];
    if (one[1] == 0x24 && current == subclass && one[2] == subtype) found.push_back(one);
  }
  return found;
}

TEST(EmulatedDepthCamera, HasTheIdsOfAD435) {
  UvcRig rig(uvc::realsenseD435());
  const Bytes device = rig.descriptor(0x0100, 64).data;
  ASSERT_EQ(device.size(), 18U);
  EXPECT_EQ(word(device, 8, 2), 0x8086U);
  EXPECT_EQ(word(device, 10, 2), 0x0b07U);
  EXPECT_EQ(Bytes(device.begin() + 4, device.begin() + 7), (Bytes{0xef, 2, 1})) << "has associations";
}

TEST(EmulatedDepthCamera, DescribesItselfInDescriptorsWhoseLengthsAddUp) {
  for (const unsigned version : {0x0100U, 0x0110U, 0x0150U}) {
    uvc::CameraModel model = uvc::realsenseD435();
    model.uvc_version = static_cast<std::uint16_t>(version);
    UvcRig rig(model);
    const Bytes configuration = rig.descriptor(0x0200).data;
    EXPECT_EQ(word(configuration, 2, 2), configuration.size());
    const auto all = taken(configuration);
    const Bytes control = ofClass(all, 1, 1).at(0), streaming = ofClass(all, 2, 1).at(0);
    std::map<std::uint8_t, std::size_t> bytes;
    std::uint8_t subclass = 0;
    for (const Bytes& one : all) {
      if (one[1] == 4) subclass = one[6];
      if (one[1] == 0x24) bytes[subclass] += one.size();
    }
    EXPECT_EQ(word(control, 3, 2), version);
    EXPECT_EQ(word(control, 5, 2), bytes[1]);
    EXPECT_EQ(word(streaming, 4, 2), bytes[2]);
    EXPECT_EQ(streaming.at(6), 0x82) << "the endpoint";
    const Bytes processing = ofClass(all, 1, 5).at(0);
    EXPECT_EQ(processing.size(), (version == 0x0100 ? 9U : 10U) + processing.at(7));
  }
}

TEST(EmulatedDepthCamera, OffersEachModeAsZ16WithItsIntervals) {
  UvcRig rig(uvc::realsenseD435());
  const auto all = taken(rig.descriptor(0x0200).data);
  const auto formats = ofClass(all, 2, 4), frames = ofClass(all, 2, 5);
  ASSERT_EQ(formats.size(), 1U);
  EXPECT_EQ(Bytes(formats[0].begin() + 5, formats[0].begin() + 21),
            (Bytes{'Z', '1', '6', ' ', 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71}));
  ASSERT_EQ(frames.size(), 6U);
  EXPECT_EQ(formats[0][4], frames.size());
  const Bytes& second = frames[1];
  EXPECT_EQ(word(second, 5, 2), 848U);
  EXPECT_EQ(word(second, 7, 2), 480U);
  EXPECT_EQ(word(second, 17), 848U * 480 * 2);
  EXPECT_EQ(word(second, 21), 333333U) << "default";
  EXPECT_EQ(second[25], 3U);
  EXPECT_EQ(word(second, 34), 111111U) << "90 Hz";
}

TEST(EmulatedDepthCamera, HasTheExtensionUnitOfRealsenseAsUnit3) {
  for (const uvc::CameraModel& model : {uvc::realsenseD435(), uvc::gemini335()}) {
    UvcRig rig(model);
    const auto units = ofClass(taken(rig.descriptor(0x0200).data), 1, 6);
    ASSERT_EQ(units.size(), 1U);
    EXPECT_EQ(units[0][3], 3U);
    // C9606CCB-594C-4D25-AF47-CCC496435995: the first three groups are little-endian
    EXPECT_EQ(Bytes(units[0].begin() + 4, units[0].begin() + 20),
              (Bytes{0xcb, 0x6c, 0x60, 0xc9, 0x4c, 0x59, 0x25, 0x4d, 0xaf, 0x47, 0xcc, 0xc4, 0x96, 0x43, 0x59,
                     0x95}));
  }
}

TEST(EmulatedDepthCamera, HasOneBulkEndpointAndNoAlternateSetting) {
  UvcRig rig;
  std::size_t interfaces = 0;
  Bytes endpoint;
  for (const Bytes& one : taken(rig.descriptor(0x0200).data)) {
    interfaces += one[1] == 4;
    if (one[1] == 5) endpoint = one;
  }
  EXPECT_EQ(interfaces, 2U);
  EXPECT_EQ(endpoint, (Bytes{7, 5, 0x82, 2, 0, 2, 0}));
}

TEST(EmulatedDepthCamera, ShowsFaultsOfDescriptorsWhenItIsPluggedInAgain) {
  UvcRig rig;
  const Bytes good = rig.descriptor(0x0200).data;
  for (const char* fault : {"lies-about-size", "unknown-format", "no-frames", "frame-zero", "interval-zero",
                            "no-endpoint", "no-unit", "descriptor-cut"}) {
    rig.tell(std::string("fault ") + fault);
    EXPECT_EQ(rig.descriptor(0x0200).data, good) << fault << " before that";
    rig.plug();
    EXPECT_NE(rig.descriptor(0x0200).data, good) << fault;
    rig.tell("resume");
    rig.plug();
    EXPECT_EQ(rig.descriptor(0x0200).data, good) << fault << " is over";
  }
}

TEST(EmulatedDepthCamera, OffersOnlyTheModeThatWasAskedForAfterItIsPluggedInAgain) {
  UvcRig rig;
  rig.tell("modes 64x48");
  rig.plug();
  const auto frames = ofClass(taken(rig.descriptor(0x0200).data), 2, 5);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(word(frames[0], 5, 2), 64U);
  EXPECT_EQ(rig.device().command("modes 65x48").substr(0, 6), "error:");
}

}  // namespace
}  // namespace hapticd::test
