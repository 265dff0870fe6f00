// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/additions/pose_lines.h"

#include <gtest/gtest.h>

namespace hapticd::tools {
namespace {

TEST(PoseLines, AreNumbersWithCommasOrBlanks) {
  const Json pose{{"positionM", {0.1, -0.2, 3.0}}, {"orientationXyzw", {0.0, 0.0, 0.0, 1.0}}};
  for (const char* line : {"0.1,-0.2,3,0,0,0,1", "  0.1 -0.2 3   0 0 0 1\r", "0.1, -0.2, 3, 0, 0, 0, 1"})
    EXPECT_EQ(poseFromLine(line), pose) << line;
  Json aged = pose;
  aged["ageS"] = 0.02;
  EXPECT_EQ(poseFromLine("0.1,-0.2,3,0,0,0,1,0.02"), aged);
}

TEST(PoseLines, AreObjectsOfTheCallAsWell) {
  const Json pose{{"positionM", {0, 0, 0}}, {"orientationXyzw", {0, 0, 0, 1}}, {"timeNs", 12}};
  EXPECT_EQ(poseFromLine(pose.dump()), pose);
}

TEST(PoseLines, MayBeEmptyOrComments) {
  for (const char* line : {"", "  \t", "# x,y,z,qx,qy,qz,qw"}) EXPECT_EQ(poseFromLine(line), Json()) << line;
}

TEST(PoseLines, AreRefusedWithTheReason) {
  const auto refusal = [](const char* line) {
    const auto pose = poseFromLine(line);
    return pose ? std::string("none") : pose.error();
  };
  EXPECT_EQ(refusal("1,2,3"), "has 3 numbers; write x,y,z,qx,qy,qz,qw or these and an age");
  EXPECT_EQ(refusal("1,2,3,0,0,0,nan"), "\"nan\" is not a finite number");
  EXPECT_EQ(refusal("1,2,x,0,0,0,1"), "\"x\" is not a finite number");
  EXPECT_EQ(refusal("{\"positionM\": [0,0,0]"), "is not a JSON object");
  EXPECT_EQ(refusal("{\"frame\": \"a\"}"), "has the member \"frame\", which FeedPose does not have");
}

}  // namespace
}  // namespace hapticd::tools
