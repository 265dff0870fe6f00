// SPDX-License-Identifier: Apache-2.0
// haptic-replay on recordings, against a second implementation of the paper that looks at
// every pixel.

#include <gtest/gtest.h>

#include <charconv>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>
#include <random>
#include <sstream>

#include "tests/support/recordings/depth_images.h"
#include "tests/support/recordings/made_up_scene.h"
#include "tests/support/recordings/recording.h"
#include "tests/system/support/daemon_under_test.h"
#include "tools/lib/oracle/reference_camera.h"
#include "tools/lib/oracle/spring_oracle.h"

namespace hapticd {
namespace {

using rt::Vec3;

constexpr std::size_t kPositions = 2000;
constexpr double kReplayTolerance_n = 1e-4;  // what is asked of haptic-replay

struct Image {
  std::filesystem::path file;
  double time_s;  // since the first one
};

/// "1513096835.219278" of "d-1513096835.219278-2320228015.pgm", less `origin_s`; split so that no digit is
/// lost.
double secondsOf(const std::string& name, long origin_s) {
  const std::size_t point = name.find('.'), dash = name.find('-', 2);
  return static_cast<double>(std::stol(name.substr(2, point - 2)) - origin_s) +
         std::stod("0" + name.substr(point, dash - point));
}

/// The depth images of a recording, in the order of its index.
std::vector<Image> imagesOf(const std::filesystem::path& folder) {
  std::vector<Image> images;
  std::ifstream index(folder / "INDEX.txt");
  long origin_s = 0;
  for (std::string name; std::getline(index, name);) {
    if (!name.starts_with("d-")) continue;
    if (images.empty()) origin_s = std::stol(name.substr(2));
    images.push_back({folder / name, secondsOf(name, origin_s)});
  }
  const double first_s = images.empty() ? 0 : images.front().time_s;
  for (Image& image : images) image.time_s -= first_s;
  return images;
}

/// A number as the input file holds it: its text, and the value of that text.
struct Printed {
  explicit Printed(double exact) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.9g", exact);
    text = buffer;
    value = std::stod(text);
  }
  std::string text;
  double value;
};

struct Query {
  std::string text;  // the line of the input file
  Vec3 hip;          // as that line says
  std::size_t image;
};

/// Positions near and on what each image shows, at a time when it is the newest; in the order of time.
std::vector<Query> queriesOf(const std::vector<Image>& images) {
  std::mt19937_64 random(7);
  std::vector<Query> queries;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::size_t count = kPositions * (i + 1) / images.size() - kPositions * i / images.size();
    const double begin_s = images[i].time_s;
    const double end_s = i + 1 < images.size() ? images[i + 1].time_s : begin_s + 1;
    const auto points = tools::pointsInCamera(test::rawPixelsOf(images[i].file));
    std::size_t number = 0;
    for (const Vec3& hip : test::positionsNear(points, count, random())) {
      const double share = static_cast<double>(++number) / static_cast<double>(count + 1);
      const Printed t(begin_s + share * (end_s - begin_s)), x(hip.x), y(hip.y), z(hip.z);
      queries.push_back(
          {t.text + ',' + x.text + ',' + y.text + ',' + z.text, {x.value, y.value, z.value}, i});
    }
  }
  return queries;
}

struct Answer {
  std::string input;  // the first four columns
  Vec3 force_n;
  std::size_t points;
  std::size_t frame;
};

Answer answerOf(const std::string& line) {
  std::size_t column_begin = 0;
  for (int comma = 0; comma < 4; ++comma) column_begin = line.find(',', column_begin) + 1;
  Answer answer{line.substr(0, column_begin - 1), {}, 0, 0};
  std::istringstream rest(line.substr(column_begin));
  char comma = 0;
  rest >> answer.force_n.x >> comma >> answer.force_n.y >> comma >> answer.force_n.z >> comma >>
      answer.points >> comma >> answer.frame;
  EXPECT_TRUE(rest && rest.peek() == std::istringstream::traits_type::eof()) << line;
  return answer;
}

std::vector<Answer> replay(const std::filesystem::path& recording, const std::vector<Query>& queries,
                           const std::vector<std::string>& options) {
  const test::TemporaryFolder folder;
  std::string hip = "t_s,x_m,y_m,z_m\n";
  for (const Query& query : queries) hip += query.text + '\n';
  const std::filesystem::path out = folder.path() / "forces.csv";
  std::vector<std::string> arguments{
      "--config", folder.write("paper.yaml", "force: {law: nearest_springs}").string(),
      "--depth",  recording.string(),
      "--hip",    folder.write("hip.csv", hip).string(),
      "--out",    out.string()};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const test::Finished finished = test::runToEnd(test::hapticReplayCommand(arguments));
  EXPECT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;

  std::ifstream stream(out);
  std::string line;
  std::getline(stream, line);
  EXPECT_EQ(line, "t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,points,frame");
  std::vector<Answer> answers;
  while (std::getline(stream, line)) answers.push_back(answerOf(line));
  return answers;
}

struct Case {
  const char* name;
  const char* archive;
  std::vector<std::string> options;
};

std::ostream& operator<<(std::ostream& stream, const Case& value) {
  return stream << value.name;
}

class ReplayOfRecordings : public testing::TestWithParam<Case> {};

TEST_P(ReplayOfRecordings, IsTheBruteForceOverAllPixelsAt2000PositionsNearAndOnSurfaces) {
  const test::Recording recording(GetParam().archive);
  const std::filesystem::path folder = recording.path();
  const std::vector<Image> images = imagesOf(folder);
  ASSERT_GE(images.size(), 8U);
  const std::vector<Query> queries = queriesOf(images);
  ASSERT_EQ(queries.size(), kPositions);
  const std::vector<Answer> answers = replay(folder, queries, GetParam().options);
  ASSERT_EQ(answers.size(), kPositions);

  std::vector<Vec3> points;
  std::size_t image = images.size();
  std::size_t with_force = 0;
  double largest_error_n = 0;
  for (std::size_t i = 0; i < kPositions; ++i) {
    if (queries[i].image != image) {
      image = queries[i].image;
      points = tools::pointsInCamera(test::rawPixelsOf(images[image].file));
    }
    const tools::SpringOracle expected(points, queries[i].hip, {});
    const double error_n = expected.error_n(answers[i].force_n);
    EXPECT_LT(error_n, kReplayTolerance_n) << "at " << queries[i].text;
    EXPECT_EQ(answers[i].points, expected.pointsUsed()) << "at " << queries[i].text;
    EXPECT_EQ(answers[i].frame, image) << "at " << queries[i].text;
    EXPECT_EQ(answers[i].input, queries[i].text);
    if (expected.pointsUsed() > 0) ++with_force;
    largest_error_n = std::max(largest_error_n, error_n);
  }
  EXPECT_GT(with_force, kPositions / 2);  // so that there is something to compare
  std::cout << GetParam().name << ": largest error " << largest_error_n << " N, " << with_force << " of "
            << kPositions << " positions with a force\n";
}

INSTANTIATE_TEST_SUITE_P(
    AllRecordings, ReplayOfRecordings,
    testing::Values(
        Case{"RoomGestureReach", "01_raw11_room_gesture/room_gesture.tar.xz", {}},
        Case{"RoomGestureFullModel", "01_raw11_room_gesture/room_gesture.tar.xz", {"--full-model"}},
        Case{"DeskNearReach", "02_raw11_desk_near/desk_near.tar.xz", {}},
        Case{"DeskNearFullModel", "02_raw11_desk_near/desk_near.tar.xz", {"--full-model"}},
        Case{"RoomStaticReach", "03_raw11_room_static/room_static.tar.xz", {}},
        Case{"RoomStaticFullModel", "03_raw11_room_static/room_static.tar.xz", {"--full-model"}}),
    [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace hapticd
