// SPDX-License-Identifier: Apache-2.0
// A trace as a source of the live picture: random access, the time line, and the playback.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "drivers/trace/depth_codec.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticd-view/recorded/recorded_session.h"
#include "tools/hapticd-view/recorded/timeline.h"
#include "tools/hapticd-view/recorded/trace_source.h"

namespace hapticd::tools::view {
namespace {

constexpr std::int64_t kMs_ns = 1'000'000;
constexpr std::int64_t kBegin_ns = 5'000 * kMs_ns;
constexpr std::size_t kTicks = 2000;
constexpr std::size_t kFrames = 5;
constexpr std::size_t kStrongest = 650;

/// Tick `number` is due that many milliseconds after the begin.
rt::Tick tickAt(std::size_t number) {
  rt::Tick tick;
  tick.number = number + 1;
  tick.planned_ns = kBegin_ns + static_cast<std::int64_t>(number) * kMs_ns;
  tick.mode = number < 300 ? rt::Mode::idle : number < 1500 ? rt::Mode::engaged : rt::Mode::faulted;
  tick.cause = number < 1500 ? rt::Cause::requested : rt::Cause::handle_stale;
  tick.law = rt::ForceLaw::surface;
  const bool in_contact =
      (number >= 500 && number < 700) || (number >= 730 && number < 800) || (number >= 1000 && number < 1010);
  if (in_contact) tick.contact = rt::ContactState::contact;
  if (in_contact) tick.command_force_n_in_world = {0, 0, number == kStrongest ? 3.5 : 1.0};
  return tick;
}

rt::DepthFrameHeader headerOf(std::size_t index) {
  rt::DepthFrameHeader header;
  header.width_px = 8;
  header.height_px = 2;
  header.stride_bytes = 16;
  header.frame = index + 1;
  header.arrival_ns = kBegin_ns + static_cast<std::int64_t>(100 + 300 * index) * kMs_ns;
  return header;
}

std::vector<std::byte> imageOf(std::size_t index) {
  return std::vector<std::byte>(32, static_cast<std::byte>(index + 1));
}

test::MadeUpRecords recordsOfSession() {
  test::MadeUpRecords records;
  for (std::size_t number = 0; number < kTicks; ++number) records.ticks.push_back(tickAt(number));
  for (const int model : {1, 2}) {
    drivers::ModelRecord record;
    record.model = static_cast<std::uint64_t>(model);
    record.time_ns = kBegin_ns + model * 400 * kMs_ns;
    record.centre_m_in_world = {0.5 * model, 0, -1};
    record.radius_m = 0.1 * model;
    records.models.push_back(record);
  }
  records.directives.push_back({.time_ns = kBegin_ns + 600 * kMs_ns,
                                .generation = 2,
                                .parameters = {{"force.radius_m", "0.03"}, {"force.law", "surface"}}});
  records.additions.push_back(
      {.time_ns = kBegin_ns + 700 * kMs_ns,
       .fixture_generation = 1,
       .text = "fixtures: [{name: ball, kind: sphere, position_m: [0, 0, -1], radius_m: 0.05}]\n"});
  records.events.push_back({.time_ns = kBegin_ns + 900 * kMs_ns, .kind = "mark", .text = "here"});
  records.events.push_back({.time_ns = kBegin_ns + 1500 * kMs_ns, .kind = "mode", .text = "faulted"});
  drivers::DepthEncoder encoder;
  for (std::size_t index = 0; index < kFrames; ++index) {
    encoder.encode(headerOf(index), imageOf(index), records.depth.emplace_back());
  }
  return records;
}

class RecordedSessionTest : public testing::Test {
 protected:
  std::filesystem::path file() const { return folder_.path() / "session.mcap"; }
  RecordedSession load(const test::MadeUpRecords& records = recordsOfSession()) const {
    drivers::TraceOptions options;
    options.depth = !records.depth.empty();
    options.attachments.push_back(
        {"settings.yaml", "application/yaml", "force: {radius_m: 0.02, law: 'auto'}\n"});
    test::writeTrace(file(), records, 500, options);
    auto session = RecordedSession::load(file());
    EXPECT_TRUE(session.has_value()) << session.error().text();
    return std::move(*session);
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(RecordedSessionTest, GivesFixturesOfAnyTime) {
  const RecordedSession session = load();
  const auto fixturesAt = [&](std::int64_t time_ns) {
    return session.additions(session.additionsAt(time_ns)).at("fixtures");
  };
  EXPECT_TRUE(fixturesAt(kBegin_ns + 699 * kMs_ns).empty());
  const Json fixtures = fixturesAt(kBegin_ns + 700 * kMs_ns);
  ASSERT_EQ(fixtures.size(), 1U);
  EXPECT_EQ(fixtures[0].at("name"), "ball");
  EXPECT_EQ(fixtures[0].at("enabled"), true);
  EXPECT_EQ(fixtures[0].at("definition").at("radius_m"), 0.05);
}

TEST_F(RecordedSessionTest, GivesTicksAndFramesOfAnyTime) {
  const RecordedSession session = load();
  EXPECT_EQ("session", session.name());
  EXPECT_DOUBLE_EQ(1.999, session.duration_s());
  ASSERT_EQ(kTicks, session.ticks().size());
  const auto some = session.ticksWithin(kBegin_ns + 99 * kMs_ns, kBegin_ns + 102 * kMs_ns);
  ASSERT_EQ(3U, some.size());
  EXPECT_EQ(101U, some.front().number);
  EXPECT_TRUE(session.ticksWithin(kBegin_ns + 5 * kMs_ns, kBegin_ns).empty());
  EXPECT_EQ(test::bitsOf(tickAt(kStrongest)), test::bitsOf(session.ticks()[kStrongest]));

  EXPECT_FALSE(session.frameAt(kBegin_ns + 99 * kMs_ns));
  EXPECT_EQ(0U, session.frameAt(kBegin_ns + 100 * kMs_ns));
  EXPECT_EQ(kFrames - 1, session.frameAt(session.end_ns()));
  for (const std::size_t index : {4U, 0U, 2U}) {
    const auto picture = session.picture(index);
    ASSERT_TRUE(picture);
    EXPECT_EQ(index + 1, picture->header.frame);
    EXPECT_EQ(imageOf(index), picture->image);
  }
}

TEST_F(RecordedSessionTest, KnowsModelAndParametersOfATime) {
  const RecordedSession session = load();
  EXPECT_EQ(nullptr, session.modelAt(kBegin_ns + 399 * kMs_ns));
  EXPECT_EQ(1U, session.modelAt(kBegin_ns + 799 * kMs_ns)->model);
  EXPECT_EQ(2U, session.modelAt(session.end_ns())->model);
  EXPECT_EQ((Json{{"force.radius_m", 0.02}, {"force.law", "auto"}}),
            session.parameters(session.parameterSetAt(session.begin_ns())));
  EXPECT_EQ((Json{{"force.radius_m", 0.03}, {"force.law", "surface"}}),
            session.parameters(session.parameterSetAt(session.end_ns())));
}

TEST_F(RecordedSessionTest, HasATimelineOfModesFaultsContactsAndMarks) {
  const Json timeline = timelineOf(load());
  EXPECT_DOUBLE_EQ(0.65, timeline["largestForceS"].get<double>());
  EXPECT_DOUBLE_EQ(3.5, timeline["largestForceN"].get<double>());
  std::vector<std::string> marks;
  for (const Json& mark : timeline["marks"]) {
    marks.push_back(
        fmt::format("{} {:.3f} {} {}", mark["kind"].get<std::string>(), mark["s"].get<double>(),
                    mark["endS"].is_null() ? "-" : fmt::format("{:.3f}", mark["endS"].get<double>()),
                    mark["text"].get<std::string>()));
  }
  // the pause of 31 ms belongs to a contact, that of 201 ms ends it
  EXPECT_EQ(marks, (std::vector<std::string>{
                       "mode 0.000 0.300 idle (requested)", "mode 0.300 1.500 engaged (requested)",
                       "fault 1.500 1.999 faulted (handle_stale)", "contact 0.500 0.799 in contact",
                       "contact 1.000 1.009 in contact", "mark 0.900 - here", "event 1.500 - faulted"}));
}

TEST_F(RecordedSessionTest, JoinsContactsRatherThanListingThousands) {
  test::MadeUpRecords records;
  for (std::size_t number = 0; number < 300'000; ++number) {
    rt::Tick tick = tickAt(0);
    tick.number = number + 1;
    tick.planned_ns = kBegin_ns + static_cast<std::int64_t>(number) * kMs_ns;
    if (number % 100 < 20) tick.contact = rt::ContactState::contact;
    records.ticks.push_back(tick);
  }
  const Json timeline = timelineOf(load(records));
  EXPECT_LE(timeline["marks"].size(), 1001U);
  EXPECT_GE(timeline["marks"].size(), 2U);
}

TEST_F(RecordedSessionTest, KeepsTheFaultsAndTheLongestModesOfThousands) {
  constexpr std::size_t kLong = 50'000, kShort = 10'000, kFault = kLong + 3001;
  test::MadeUpRecords records;
  for (std::size_t number = 0; number < kLong + kShort; ++number) {
    rt::Tick tick = tickAt(0);
    tick.number = number + 1;
    tick.planned_ns = kBegin_ns + static_cast<std::int64_t>(number) * kMs_ns;
    if (number >= kLong) tick.mode = number % 2 == 0 ? rt::Mode::engaged : rt::Mode::holding;
    if (number == kFault) tick.mode = rt::Mode::faulted;
    records.ticks.push_back(tick);
  }
  const Json marks = timelineOf(load(records))["marks"];
  EXPECT_EQ(marks.size(), 1000U);
  EXPECT_EQ(marks[0]["kind"], "mode");
  EXPECT_EQ(marks[0]["s"], 0.0);
  double end_s = 0;
  std::size_t faults = 0;
  for (const Json& mark : marks) {
    EXPECT_EQ(mark["s"].get<double>(), end_s) << "each reaches to the next one";
    end_s = mark["endS"].get<double>();
    if (mark["kind"] == "fault") ++faults;
  }
  EXPECT_EQ(faults, 1U);
  EXPECT_DOUBLE_EQ(end_s, static_cast<double>(kLong + kShort - 1) / 1000);
}

TEST_F(RecordedSessionTest, RefusesTicksWhoseTimesAreImpossible) {
  for (const std::int64_t time_ns : {std::int64_t{0}, std::int64_t{-1}, INT64_MAX, INT64_MIN}) {
    test::MadeUpRecords records = recordsOfSession();
    records.ticks[1000].planned_ns = time_ns;
    std::filesystem::remove(file());
    test::writeTrace(file(), records, 500, {.depth = true});
    const auto session = RecordedSession::load(file());
    ASSERT_FALSE(session);
    EXPECT_NE(session.error().text().find("tick "), std::string::npos) << session.error().text();
  }
}

TEST_F(RecordedSessionTest, RefusesWhatItCannotShow) {
  const auto missing = RecordedSession::load(file());
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().text().find("session.mcap"), std::string::npos);
  test::writeTrace(file(), {}, 500);
  const auto empty = RecordedSession::load(file());
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().text().find("no ticks"), std::string::npos);
}

/// Keeps what it is shown.
class KeepingViewer final : public Viewer {
 public:
  void onTick(const rt::Tick& tick) override { numbers.push_back(tick.number); }
  void onStatus(const Json& now) override { status = now; }
  void onParameters(const Json& now) override { parameters = now; }
  void onEvent(const Json& event) override { events.push_back(event["text"]); }
  void onDepth(const std::shared_ptr<const DepthPicture>& picture) override {
    frames.push_back(picture->header.frame);
  }
  void onDepthState(bool available, const std::string&) override { depth_available = available; }
  void onTimeline(const Json& now) override { timeline = now; }
  void onPlayback(const Json& now) override { playback = now; }
  bool wantsTicks() const override { return true; }
  bool wantsDepth() const override { return true; }
  void clear() {
    numbers.clear();
    frames.clear();
    events.clear();
  }

  std::vector<std::uint64_t> numbers;
  std::vector<std::uint64_t> frames;
  std::vector<std::string> events;
  Json status, parameters, timeline, playback;
  bool depth_available = false;
};

TEST_F(RecordedSessionTest, ShowsTheMomentThatAViewerMovesTo) {
  boost::asio::io_context context;
  TraceSource source(context, load(), "1.2.3");
  EXPECT_EQ("trace", source.hello()["source"]);
  EXPECT_EQ(true, source.hello()["trace"]["depth"]);
  KeepingViewer viewer;
  source.add(viewer);
  EXPECT_TRUE(viewer.depth_available);
  EXPECT_EQ("timeline", viewer.timeline["type"]);
  EXPECT_EQ("idle", viewer.status["mode"]);
  EXPECT_EQ((std::vector<std::uint64_t>{1}), viewer.numbers);
  EXPECT_EQ((std::vector<std::uint64_t>{1}), viewer.frames) << "though it arrives 100 ms after the begin";

  source.control(Step{1});
  EXPECT_EQ(2U, viewer.frames.back());

  source.control(Seek{0.65});
  EXPECT_EQ(kStrongest + 1, viewer.numbers.back());
  EXPECT_EQ(2U, viewer.frames.back());
  EXPECT_EQ("engaged", viewer.status["mode"]);
  EXPECT_EQ(0.1, viewer.status["scene"]["ballRadiusM"]);
  EXPECT_EQ(0.03, viewer.parameters["force.radius_m"]);
  EXPECT_EQ(false, viewer.playback["playing"]);

  source.control(Step{1});
  EXPECT_EQ(3U, viewer.frames.back());
  EXPECT_EQ(701U, viewer.numbers.back());
  source.control(Step{-2});
  EXPECT_EQ(1U, viewer.frames.back());
  source.control(Step{-5});
  EXPECT_EQ(1U, viewer.frames.back());
  source.control(Seek{99});
  EXPECT_EQ(kTicks, viewer.numbers.back());
  source.remove(viewer);
}

TEST_F(RecordedSessionTest, PlaysEveryTickOnceAndStopsAtTheEnd) {
  boost::asio::io_context context;
  TraceSource source(context, load(), "1.2.3");
  KeepingViewer viewer;
  source.add(viewer);
  viewer.clear();
  source.control(Speed{50});
  source.control(Play{});
  context.run();  // ends when nothing is scheduled any more
  ASSERT_EQ(kTicks - 1, viewer.numbers.size());
  for (std::size_t i = 0; i < viewer.numbers.size(); ++i) ASSERT_EQ(i + 2, viewer.numbers[i]);
  EXPECT_EQ((std::vector<std::string>{"here", "faulted"}), viewer.events);
  EXPECT_EQ(kFrames, viewer.frames.back());
  EXPECT_EQ(false, viewer.playback["playing"]);
  EXPECT_EQ("faulted", viewer.status["mode"]);

  viewer.clear();
  context.restart();
  source.control(Play{});  // from the begin again
  source.control(Pause{});
  EXPECT_EQ(0.0, viewer.playback["s"]);
  context.run();
  source.remove(viewer);
}

TEST_F(RecordedSessionTest, SaysThatATraceHasNoDepth) {
  test::MadeUpRecords records = recordsOfSession();
  records.depth.clear();
  boost::asio::io_context context;
  TraceSource source(context, load(records), "1.2.3");
  KeepingViewer viewer;
  viewer.depth_available = true;
  source.add(viewer);
  EXPECT_FALSE(viewer.depth_available);
  source.control(Step{3});
  EXPECT_NEAR(0.1, viewer.playback["s"].get<double>(), 1e-9);
  source.remove(viewer);
}

}  // namespace
}  // namespace hapticd::tools::view
