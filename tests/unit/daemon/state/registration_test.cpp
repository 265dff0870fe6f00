// SPDX-License-Identifier: Apache-2.0
// The registration of the camera on the disk.
#include "daemon/state/start_settings.h"

#include <gtest/gtest.h>

#include "daemon/state/profile_folder.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

const Registration kRegistration{{{0.1, -2, 1e-7}, 0.3, -0.4, 3.1}, 0.00123, "2026-03-04T05:06:07Z"};

/// Returns the problems of the file in one text.
std::string problemsIn(const std::string& yaml) {
  const test::TemporaryFolder folder;
  folder.write("registration.yaml", yaml);
  const auto read = readRegistration(folder.path());
  return read ? "" : textOf(read.error());
}

TEST(Registration, ReadsBackWhatWasWritten) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(writeRegistration(folder.path(), kRegistration));
  const auto read = readRegistration(folder.path());
  ASSERT_TRUE(read && *read);
  EXPECT_TRUE(same((*read)->T_world_camera, kRegistration.T_world_camera));
  EXPECT_EQ((*read)->residual_m, kRegistration.residual_m);
  EXPECT_EQ((*read)->time, kRegistration.time);
}

TEST(Registration, GoesAwayWhenThereIsToBeNone) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(readRegistration(folder.path()).value());
  ASSERT_TRUE(writeRegistration(folder.path(), kRegistration));
  ASSERT_TRUE(writeRegistration(folder.path(), std::nullopt));
  EXPECT_FALSE(readRegistration(folder.path()).value());
}

TEST(Registration, ReadsAPoseThatSomebodyHasWritten) {
  const test::TemporaryFolder folder;
  folder.write("registration.yaml",
               "camera: {position_x_m: 1, position_y_m: 2, position_z_m: 3, roll_rad: 0, pitch_rad: 0, "
               "yaw_rad: 0}\n");
  const auto read = readRegistration(folder.path());
  ASSERT_TRUE(read && *read);
  EXPECT_EQ((*read)->T_world_camera.position_m.z, 3);
  EXPECT_FALSE((*read)->residual_m);
  EXPECT_EQ((*read)->time, "");
}

TEST(Registration, TakesNoTimeThatIsNone) {
  const std::string pose =
      "camera: {position_x_m: 1, position_y_m: 2, position_z_m: 3, roll_rad: 0, pitch_rad: 0, yaw_rad: 0}\n";
  for (const std::string& time :
       {std::string("yesterday"), std::string(3000, '0'), std::string("2026-03-04T05:06:07Z ")}) {
    const test::TemporaryFolder folder;
    folder.write("registration.yaml", "# time: " + time + "\n" + pose);
    const auto read = readRegistration(folder.path());
    ASSERT_TRUE(read && *read);
    EXPECT_EQ((*read)->time, "");
  }
}

TEST(Registration, NamesWhatIsWrongWithItsFile) {
  EXPECT_NE(problemsIn("camera: {position_x_m: 1}\n").find("1 of the 6 values"), std::string::npos);
  EXPECT_NE(problemsIn("").find("0 of the 6 values"), std::string::npos);
  EXPECT_NE(problemsIn("camera: {position_x_m: 11}\n").find("out of range"), std::string::npos);
  EXPECT_NE(problemsIn("camera: {near_m: 1}\n").find("camera.near_m"), std::string::npos);
  EXPECT_NE(problemsIn("camera: [\n"), "");
  EXPECT_NE(problemsIn(std::string("\0\0\0", 3)), "");
}

TEST(Registration, KnowsWhichPosesAreOutOfRange) {
  EXPECT_TRUE(problemsOf(kRegistration.T_world_camera, {}).empty());
  EXPECT_EQ(problemsOf({{99, 0, 0}, 0, 9, 0}, {}).size(), 2U);
}

}  // namespace
}  // namespace hapticd::daemon
