// SPDX-License-Identifier: Apache-2.0
// Bytes of the kernel that come in pieces, are nonsense, or end.

#include <gtest/gtest.h>

#include "tests/vm/emulators/tests/kinect_rig.h"

namespace hapticd::test {
namespace {

// GET_CONFIGURATION: request 1 of device 1-2, IN, endpoint 0
const Bytes kRequest{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 2, 0, 0, 0, 1, 0,    0, 0, 0, 0, 0, 0, 0,
                     0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 8, 0, 0, 0, 0, 1, 0};

TEST_F(EmulatedKinect, UnderstandsRequestsThatArriveByteByByte) {
  for (const std::uint8_t byte : kRequest) {
    EXPECT_EQ(rig_.counts().completed, 0U);
    rig_.host().send({byte});
    rig_.serve();
  }
  EXPECT_EQ(rig_.counts().completed, 1U);
}

TEST_F(EmulatedKinect, UnderstandsRequestsThatArriveTogetherWithAPartOfTheNext) {
  Bytes one_and_a_half = kRequest;
  one_and_a_half.insert(one_and_a_half.end(), kRequest.begin(), kRequest.begin() + 24);
  rig_.host().send(one_and_a_half);
  rig_.serve();
  EXPECT_EQ(rig_.counts().completed, 1U);
  rig_.host().send(Bytes(kRequest.begin() + 24, kRequest.end()));
  rig_.serve();
  EXPECT_EQ(rig_.counts().completed, 2U);
  EXPECT_TRUE(rig_.connection().isAlive());
}

TEST_F(EmulatedKinect, GivesUpAConnectionOnWhichItUnderstandsNothing) {
  rig_.host().send(Bytes(48, 0xee));
  rig_.serve();
  EXPECT_FALSE(rig_.connection().isAlive());
}

TEST_F(EmulatedKinect, NoticesThatTheKernelHasHungUp) {
  rig_.host().hangUp();
  rig_.serve();
  EXPECT_FALSE(rig_.connection().isAlive());
}

}  // namespace
}  // namespace hapticd::test
