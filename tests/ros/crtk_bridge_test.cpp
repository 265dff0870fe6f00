// SPDX-License-Identifier: Apache-2.0
// haptic-crtk-bridge between a simulated arm that speaks CRTK over DDS and a peer that commands forces in the
// place of hapticd.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <optional>

#include "ros_messages.h"
#include "rt/base/clock.h"
#include "tests/ros/ros_listener.h"
#include "tests/ros/simulated_crtk_arm.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/vendor_devices/peer.h"
#include "tools/haptic-crtk-bridge/arm_measurement.h"
#include "tools/haptic-crtk-bridge/arm_topics.h"

namespace hapticd::test {
namespace {

const rt::Vec3 kForce_n{0.5, -1, 1.5};

/// A hand that holds the tool at one place, which is not on an axis; turned, and with a base frame.
CrtkArmSettings turnedArm() {
  CrtkArmSettings settings;
  settings.hand.start_m_in_world = {0.3, -0.2, 0.15};
  settings.hand.direction_in_world = {1, 0.5, 0.2};
  settings.hand.speed_m_per_s = 1e-6;
  settings.T_base_local = {{0.05, 0.5, -0.1}, rt::normalised({0.1, 0.6, -0.2, 0.7})};
  settings.turned = rt::normalised({0.3, -0.5, 0.1, 0.8});
  return settings;
}

class CrtkBridge : public ::testing::Test {
 protected:
  void makeArm(const CrtkArmSettings& settings = turnedArm()) {
    settings_ = settings;
    arm_.emplace(ownDomain(), ownNamespace(), settings);
  }
  void start(const std::vector<std::string>& more = {}) {
    std::vector<std::string> command{HAPTIC_CRTK_BRIDGE_PROGRAM,
                                     "--arm",
                                     ownNamespace(),
                                     "--domain",
                                     std::to_string(ownDomain()),
                                     "--peer",
                                     peer_->address(),
                                     "--max-force",
                                     "100"};
    command.insert(command.end(), more.begin(), more.end());
    program_.emplace(command);
  }
  /// Starts, commands the force, and waits until the arm exerts it.
  void startPushing(const std::vector<std::string>& more = {}) {
    peer_->command({.force_n = kForce_n});
    start(more);
    ASSERT_TRUE(exerts(true)) << program_->errors();
  }
  bool exerts(bool something) {
    return becomesTrue([&] { return (norm(arm_->record().exerted_n) > 0) == something; });
  }
  bool says(const std::string& text) {
    const bool said = becomesTrue([&] { return program_->errors().find(text) != std::string::npos; });
    if (!said) ADD_FAILURE() << "not said: " << text << "\n" << program_->errors();
    return said;
  }
  /// Waits until the arm exerts nothing; how long after `since_ns` that was, in ms.
  double zeroAfter_ms(std::int64_t since_ns) {
    EXPECT_TRUE(exerts(false)) << program_->errors();
    return static_cast<double>(arm_->record().last_exerted_ns - since_ns) * 1e-6;
  }
  /// Waits until nothing but zero has been commanded for a while.
  bool commandsZero() {
    constexpr std::uint64_t kInARow = 20;
    return becomesTrue([&] { return arm_->record().zeros_in_a_row >= kInARow; });
  }
  bool handleIs(bool calibrated, bool fault) {
    return becomesTrue([&] {
      const drivers::udp::StatePacket state = peer_->state();
      return state.header.sequence > 0 && state.calibrated == calibrated && state.fault == fault;
    });
  }

  CrtkArmSettings settings_;
  std::optional<Peer> peer_{std::in_place};
  std::optional<SimulatedCrtkArm> arm_;
  std::optional<Program> program_;
};

void expectNear(const rt::Vec3& a, const rt::Vec3& b, double tolerance) {
  EXPECT_LE(norm(a - b), tolerance) << fmt::format("{} {} {}, not {} {} {}", a.x, a.y, a.z, b.x, b.y, b.z);
}

/// How the arm takes wrenches, and whether the handle's frame is that of measured_cp or of local/measured_cp.
struct WrenchCase {
  std::string convention;
  bool in_local = false;
  bool knows_only_base = false;  // the arm

  CrtkArmSettings arm() const {
    CrtkArmSettings settings = turnedArm();
    settings.has_absolute = !knows_only_base;
    settings.knows_only_base = knows_only_base;
    return settings;
  }
};
void PrintTo(const WrenchCase& one, std::ostream* stream) {
  *stream << one.convention;
}
class CrtkWrench : public CrtkBridge, public ::testing::WithParamInterface<WrenchCase> {};

TEST_P(CrtkWrench, ActsAtTheTipAlongTheAxesOfTheMeasurementsAndWithoutTorque) {
  makeArm(GetParam().arm());
  startPushing({"--wrench", GetParam().convention});
  // the hand gives way: what it does until the force has settled is not looked at
  const rt::Quaternion& base = settings_.T_base_local.orientation;
  const rt::Vec3 expected_n = GetParam().in_local ? kForce_n : rotated(inverse(base), kForce_n);
  // the orientation turns with the hand's motion within a period of the arm: 1e-3 of 1.9 N
  EXPECT_TRUE(becomesTrue([&] { return norm(arm_->record().exerted_n - expected_n) < 2e-3; }));
  const CrtkArmRecord record = arm_->record();
  expectNear(record.exerted_n, expected_n, 2e-3);
  EXPECT_NEAR(record.most_exerted_n, norm(kForce_n), 1e-9) << "no stronger force in any direction before";
  EXPECT_LT(norm(record.tip_torque_n_m), 2e-3);
  EXPECT_EQ(record.absolute, GetParam().convention == "body-absolute");
  EXPECT_FALSE(record.gravity_compensation);
}

TEST_P(CrtkWrench, ComesWithThePositionInMetresAndTheOrientationOfTheTool) {
  makeArm(GetParam().arm());
  start({"--wrench", GetParam().convention});
  ASSERT_TRUE(handleIs(true, false)) << program_->errors();
  const drivers::udp::StatePacket state = peer_->state();
  const rt::Vec3 start_m = settings_.hand.start_m_in_world;
  const rt::RigidPose& base = settings_.T_base_local;
  const rt::Vec3 expected_m =
      GetParam().in_local ? start_m : base.position_m_in_world + rotated(base.orientation, start_m);
  expectNear(state.position_m_in_handle, expected_m, 1e-3);  // the hand creeps
  ASSERT_TRUE(state.orientation_in_handle);
  EXPECT_NEAR(dot(*state.orientation_in_handle, *state.orientation_in_handle), 1, 1e-9);
  EXPECT_FALSE(state.velocity_valid) << "hapticd takes it from the positions";
  EXPECT_FALSE(state.drives_torque);
  arm_->setGripper(0.75);
  EXPECT_TRUE(becomesTrue([&] { return peer_->state().gripper_rad == 0.75; }));
}

INSTANTIATE_TEST_SUITE_P(All, CrtkWrench,
                         ::testing::Values(WrenchCase{"body-absolute"}, WrenchCase{"body"},
                                           WrenchCase{"base", false, true}, WrenchCase{"spatial", true}),
                         [](const auto& one) {
                           return one.param.convention == "body-absolute" ? "bodyAbsolute"
                                                                          : one.param.convention;
                         });

TEST_F(CrtkBridge, LeavesTheArmWithZeroForcesOnSigtermAndCtrlC) {
  for (const int signal : {SIGTERM, SIGINT}) {
    makeArm();
    startPushing();
    const std::int64_t since_ns = rt::monotonicNow_ns();
    program_->signal(signal);
    EXPECT_EQ(program_->wait(), exitedWith(0)) << program_->errors();
    RecordProperty("zero_ms", std::to_string(zeroAfter_ms(since_ns)));
    EXPECT_TRUE(commandsZero());
    EXPECT_EQ(program_->errors().find("did not acknowledge"), std::string::npos) << program_->errors();
    EXPECT_NE(program_->output().find("strongest force, N            1.871"), std::string::npos)
        << program_->output();
  }
}

TEST_F(CrtkBridge, LetsGoWhenHapticdIsGoneOrCommandsZeroAndPushesAgain) {
  makeArm();
  startPushing();
  peer_->command({});
  EXPECT_TRUE(exerts(false));
  peer_->command({.force_n = kForce_n});
  ASSERT_TRUE(exerts(true));
  peer_.reset();
  EXPECT_TRUE(exerts(false)) << "the dead man of 20 ms";
  EXPECT_TRUE(commandsZero()) << "and it goes on with zero, since the arm would keep the last force";
  program_->signal(SIGTERM);
  EXPECT_EQ(program_->wait(), exitedWith(0));
}

// Nothing is left that could send a zero.
TEST_F(CrtkBridge, LeavesTheLastForceToAnArmWithoutWatchdogWhenItIsKilledUntilItIsStartedAgain) {
  makeArm();
  startPushing();
  program_->signal(SIGKILL);
  (void)program_->wait();
  peer_->command({});
  const std::int64_t killed_ns = rt::monotonicNow_ns();
  ASSERT_TRUE(becomesTrue([&] { return arm_->record().last_exerted_ns - killed_ns > 300'000'000; }))
      << "the force goes on";
  start();
  EXPECT_TRUE(exerts(false)) << program_->errors();
}

TEST_F(CrtkBridge, LeavesItToTheWatchdogOfAnArmToDropTheForceWhenItIsKilled) {
  CrtkArmSettings settings = turnedArm();
  settings.watchdog_ns = 50'000'000;
  makeArm(settings);
  startPushing();
  program_->signal(SIGKILL);
  (void)program_->wait();
  ASSERT_TRUE(exerts(false));
  const CrtkArmRecord record = arm_->record();
  EXPECT_LE(record.last_exerted_ns - record.last_wrench_ns, settings.watchdog_ns + 2 * settings.period_ns);
  start();
  EXPECT_TRUE(exerts(true)) << program_->errors();
}

TEST_F(CrtkBridge, GivesNoForceInAStateWithoutOneAndSaysIt) {
  struct StateCase {
    const char* state;
    bool is_homed;
    bool calibrated;
    bool fault;
  };
  makeArm();
  startPushing();
  for (const StateCase& one :
       {StateCase{"PAUSED", true, false, false}, StateCase{"DISABLED", true, false, false},
        StateCase{"ENABLED", false, false, false}, StateCase{"FAULT", true, false, true},
        StateCase{"something new", true, false, false}}) {
    arm_->setState(one.state, one.is_homed);
    EXPECT_TRUE(commandsZero()) << one.state;
    EXPECT_TRUE(handleIs(one.calibrated, one.fault)) << one.state;
    EXPECT_TRUE(says(fmt::format("is {}{}", one.state, one.is_homed ? "" : ", not homed")));
    // zero for a while, and then nothing: servo_cf would take the arm from whoever moves it
    EXPECT_TRUE(
        becomesTrue([&] { return rt::monotonicNow_ns() - arm_->record().last_wrench_ns > 200'000'000; }));
    arm_->setState("ENABLED", true);
    EXPECT_TRUE(exerts(true)) << one.state << program_->errors();
  }
}

TEST_F(CrtkBridge, GivesNoForceWithoutSoundMeasurementsAndNamesWhatIsWrong) {
  struct NamedFault {
    std::uint32_t faults;
    const char* text;
  };
  makeArm();
  startPushing();
  for (const NamedFault& one :
       {NamedFault{kCrtkSilent, "no measurement for 20 ms: no force"},
        NamedFault{kCrtkNotFinite, "a measurement was rejected: its position is not finite"},
        NamedFault{kCrtkNotUnit, "rejected: the quaternion of its orientation has not the length 1"},
        NamedFault{kCrtkZeroStamp, "rejected: its stamp is zero, by which CRTK marks invalid data"}}) {
    const std::int64_t since_ns = rt::monotonicNow_ns();
    arm_->setFaults(one.faults);
    const double zero_ms = zeroAfter_ms(since_ns);
    RecordProperty(one.text, std::to_string(zero_ms));
    EXPECT_TRUE(commandsZero()) << one.text;
    EXPECT_TRUE(becomesTrue([&] { return peer_->state().fault; })) << one.text;
    says(one.text);
    arm_->setFaults(0);
    EXPECT_TRUE(exerts(true)) << one.text << program_->errors();
  }
  EXPECT_NEAR(arm_->record().most_exerted_n, norm(kForce_n), 1e-9);
}

TEST_F(CrtkBridge, GivesNoForceForTheTimeOfTheDeadManWhereThePositionJumps) {
  makeArm();
  startPushing();
  const std::uint64_t zeros = arm_->record().zeros;
  arm_->setFaults(kCrtkJump);
  EXPECT_TRUE(says("it jumped farther than a hand moves"));
  EXPECT_TRUE(becomesTrue([&] { return arm_->record().zeros > zeros; }));
  EXPECT_TRUE(exerts(true)) << "at the new place, which hapticd engages anew";
}

TEST_F(CrtkBridge, LooksForTheArmAgainWhenItHasBeenSilentForASecond) {
  makeArm();
  startPushing();
  arm_->setFaults(kCrtkSilent);
  EXPECT_TRUE(says("no measurement has come for 1 s"));
  EXPECT_TRUE(commandsZero());
  arm_->setFaults(0);
  EXPECT_TRUE(exerts(true)) << program_->errors();
}

TEST_F(CrtkBridge, SetsTheAxesAgainForAnArmThatWasStartedAgain) {
  makeArm();
  startPushing();
  arm_.reset();
  EXPECT_TRUE(says("nobody subscribes to it"));
  makeArm();
  EXPECT_TRUE(exerts(true)) << program_->errors();
  EXPECT_NEAR(arm_->record().most_exerted_n, norm(kForce_n), 1e-9);
  EXPECT_TRUE(arm_->record().absolute);
}

TEST_F(CrtkBridge, GivesNoForceInAnotherFrameThanTheFirst) {
  makeArm();
  startPushing();
  arm_->setFaults(kCrtkOtherFrame);
  EXPECT_TRUE(exerts(false));
  EXPECT_TRUE(says("its frame_id is \"elsewhere\" and not \"base\": no force"));
  EXPECT_TRUE(becomesTrue([&] { return peer_->state().fault; }));
  const std::uint64_t wrenches = arm_->record().wrenches;
  // looked for again, and refused again
  EXPECT_TRUE(peer_->states() > 0 &&
              becomesTrue([&, until = peer_->states() + 2500] { return peer_->states() > until; }));
  EXPECT_LE(arm_->record().wrenches, wrenches + 100) << "zeros of the end";
  EXPECT_GE(arm_->record().zeros_in_a_row, 20U);
  arm_->setFaults(0);
  EXPECT_TRUE(exerts(true)) << program_->errors();
}

TEST_F(CrtkBridge, RefusesAFrameThatIsNotTheWantedOne) {
  makeArm();
  peer_->command({.force_n = kForce_n});
  start({"--frame", "stereo_display"});
  EXPECT_TRUE(says("its frame_id is \"base\" and not \"stereo_display\""));
  EXPECT_EQ(arm_->record().wrenches, 0U);
}

TEST_F(CrtkBridge, RefusesAnArmThatDoesNotTakeTheAxesOfForcesAndNamesNoConventionForIt) {
  CrtkArmSettings settings = turnedArm();
  settings.has_absolute = false;
  makeArm(settings);
  peer_->command({.force_n = kForce_n});
  start();
  EXPECT_TRUE(says("body/set_cf_orientation_absolute: nobody subscribes to it"));
  EXPECT_TRUE(says("'haptic-crtk-bridge check --wrench base' finds it"));
  EXPECT_EQ(program_->errors().find("--wrench body"), std::string::npos) << program_->errors();
  EXPECT_EQ(arm_->record().wrenches, 0U);
  startPushing({"--wrench", "body"});
}

TEST_F(CrtkBridge, RefusesToTakeAnArmWhoseAxesMayBeSetForOneThatKnowsOnlyItsBase) {
  makeArm();
  peer_->command({.force_n = kForce_n});
  start({"--wrench", "base"});
  EXPECT_TRUE(says("this one takes body/set_cf_orientation_absolute"));
  EXPECT_EQ(arm_->record().wrenches, 0U);
}

TEST_F(CrtkBridge, DropsAMessageThatIsLargerThanAnyOfAnArmAndTakesTheNext) {
  makeArm();
  startPushing();
  arm_->setState(std::string(2 << 20, 'x'), true);
  EXPECT_TRUE(says("dropping oversize"));
  EXPECT_EQ(program_->errors().find("xxxx"), std::string::npos);
  arm_->setState("PAUSED", true);
  EXPECT_TRUE(says("is PAUSED"));
  EXPECT_TRUE(commandsZero());
}

TEST_F(CrtkBridge, WaitsForAnArmAndForItsState) {
  peer_->command({.force_n = kForce_n});
  start();
  EXPECT_TRUE(says("servo_cf: nobody subscribes to it"));
  EXPECT_TRUE(handleIs(false, true));
  CrtkArmSettings settings = turnedArm();
  settings.keeps_state = false;  // and it was told before the bridge was matched
  makeArm(settings);
  EXPECT_TRUE(says("operating_state: no state has come"));
  EXPECT_EQ(arm_->record().wrenches, 0U);
  arm_->setState("ENABLED", true);
  EXPECT_TRUE(exerts(true)) << program_->errors();
}

TEST_F(CrtkBridge, TurnsGravityCompensationOnWhereItIsAskedTo) {
  makeArm();
  startPushing({"--gravity-compensation"});
  EXPECT_TRUE(arm_->record().gravity_compensation);
}

/// What is built into the arm, from a motion to its force: the ways, half a period until the next
/// measurement, and half a period until the next force and half a one that it acts.
std::int64_t builtIn_ns(const CrtkArmSettings& settings) {
  return settings.measuring_delay_ns + settings.driving_delay_ns + 3 * settings.period_ns / 2;
}

// A machine that is busy is late by more, truly; one calm stretch of 256 measurements is enough.
TEST(CrtkArmDelay, IsMeasuredOverDdsToHalfAMillisecond) {
  using tools::crtk::ArmTopics;
  constexpr std::int64_t kMs = 1'000'000;
  auto topics =
      ArmTopics::open({.domain = ownDomain(), .interface = ""}, {.arm = ownNamespace(), .frame = ""});
  ASSERT_TRUE(topics) << topics.error().text();
  for (const std::int64_t period_ns : {kMs, 2 * kMs}) {
    for (const std::int64_t way_ns : {0 * kMs, 1 * kMs, 5 * kMs}) {
      CrtkArmSettings settings = turnedArm();
      settings.period_ns = period_ns;
      settings.measuring_delay_ns = settings.driving_delay_ns = way_ns;
      const SimulatedCrtkArm arm(ownDomain(), ownNamespace(), settings);
      tools::crtk::ArmDelay delay;
      const auto error_ns = [&] { return delay.latency_ns() - builtIn_ns(settings); };
      int count = 0;
      EXPECT_TRUE(becomesTrue(
          [&] {
            topics->wait(std::chrono::milliseconds(5));
            (void)topics->takeState();  // else the next wait would end at once
            topics->takePoses([&](const tools::crtk::MeasuredPose& pose) {
              delay.add(pose.stamp_utc_ns, rt::realtimeNow_ns());
              ++count;
            });
            return count > 300 && delay.trustsStamps() && std::abs(error_ns()) < kMs / 2;
          },
          std::chrono::milliseconds(0)))
          << 1e-6 * static_cast<double>(error_ns()) << " ms off";
      fmt::print("period {} ms, built in {:.2f} ms, measured {:.2f} ms\n", period_ns / kMs,
                 1e-6 * static_cast<double>(builtIn_ns(settings)),
                 1e-6 * static_cast<double>(delay.latency_ns()));
    }
  }
}

// What is above the delay of the arm is the bridge's loop and thread, at most a tick of 1 ms for each, and
// what the machine does to them.
TEST_F(CrtkBridge, TellsHapticdNoLessThanTheDelayThatIsBuiltIntoTheArm) {
  constexpr std::int64_t kMs = 1'000'000;
  for (const std::int64_t period_ns : {kMs, 2 * kMs}) {
    for (const std::int64_t way_ns : {0 * kMs, 1 * kMs, 5 * kMs}) {
      CrtkArmSettings settings = turnedArm();
      settings.period_ns = period_ns;
      settings.measuring_delay_ns = settings.driving_delay_ns = way_ns;
      makeArm(settings);
      startPushing();
      // the estimates are of the last 256 measurements
      EXPECT_TRUE(becomesTrue([&, until = peer_->states() + 1500] { return peer_->states() > until; }));
      const std::int64_t told_ns = peer_->state().device_latency_ns;
      EXPECT_GE(told_ns, builtIn_ns(settings) - kMs / 20) << "less the precision of the period's estimate";
      EXPECT_EQ(program_->errors().find("do not go with this computer's clock"), std::string::npos);
      fmt::print("period {} ms, built in {:.2f} ms, told {:.2f} ms\n", period_ns / kMs,
                 1e-6 * static_cast<double>(builtIn_ns(settings)), 1e-6 * static_cast<double>(told_ns));
    }
  }
}

TEST_F(CrtkBridge, AssumesALongDelayWhereTheArmHasAnotherClockAndSaysIt) {
  for (const std::int64_t ahead_ns : {50'000'000LL, -3'600'000'000'000LL}) {
    CrtkArmSettings settings = turnedArm();
    settings.clock_ahead_ns = ahead_ns;
    makeArm(settings);
    startPushing();
    EXPECT_TRUE(says("its stamps do not go with this computer's clock, so 10 ms are taken"));
    EXPECT_GE(peer_->state().device_latency_ns, 20'000'000 + builtIn_ns(settings) - 50'000);
  }
}

TEST_F(CrtkBridge, ChecksAnArmForAPersonAndWritesALog) {
  makeArm();
  const TemporaryFolder folder;
  const std::string log = (folder.path() / "check.json").string();
  // the person, who is the end of a file, gives up at the first question
  const Finished check = runToEnd({HAPTIC_CRTK_BRIDGE_PROGRAM, "check", "--arm", ownNamespace(), "--domain",
                                   std::to_string(ownDomain()), "--log", log});
  EXPECT_EQ(check.ending, exitedWith(69)) << check.errors;
  EXPECT_NE(check.output.find("Hold the handle in the middle of its reach"), std::string::npos);
  const Finished read = runToEnd({HAPTIC_CRTK_BRIDGE_PROGRAM, "check", "--read", log});
  EXPECT_EQ(read.ending, exitedWith(0)) << read.errors;
  EXPECT_NE(read.output.find("crtk-arm: /" + ownNamespace() + " (frame"), std::string::npos) << read.output;
  EXPECT_NE(read.output.find("measures position, orientation, gripper"), std::string::npos) << read.output;
  EXPECT_EQ(arm_->record().most_exerted_n, 0);
  const Finished unnamed = runToEnd({HAPTIC_CRTK_BRIDGE_PROGRAM, "check"});
  EXPECT_EQ(unnamed.ending, exitedWith(64));
  EXPECT_NE(unnamed.errors.find("--arm"), std::string::npos) << unnamed.errors;
}

/// A program of DDS that publishes to the arm, too.
class Rival {
 public:
  Rival()
      : participant_(dds_create_participant(static_cast<dds_domainid_t>(ownDomain()), nullptr, nullptr)) {}
  ~Rival() { dds_delete(participant_); }
  Rival(const Rival&) = delete;
  Rival& operator=(const Rival&) = delete;

  dds_entity_t writer(const std::string& topic, const dds_topic_descriptor_t& type) {
    const std::string name = "rt/" + ownNamespace() + "/" + topic;
    dds_qos_t* const qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
    const dds_entity_t made = dds_create_writer(
        participant_, dds_create_topic(participant_, &type, name.c_str(), nullptr, nullptr), qos, nullptr);
    dds_delete_qos(qos);
    return made;
  }

 private:
  dds_entity_t participant_;
};

TEST_F(CrtkBridge, GivesNoForceWhileAnotherProgramCommandsTheArm) {
  makeArm();
  startPushing();
  {
    Rival rival;
    rival.writer("body/servo_cf", geometry_msgs_msg_dds__WrenchStamped__desc);
    EXPECT_TRUE(says("another program publishes it, too"));
    EXPECT_TRUE(exerts(false));
  }
  EXPECT_TRUE(exerts(true)) << program_->errors();
}

TEST_F(CrtkBridge, SetsTheAxesAgainWhereAnotherProgramHasChangedThem) {
  makeArm();
  startPushing();
  Rival rival;
  const dds_entity_t setting = rival.writer("body/set_cf_orientation_absolute", std_msgs_msg_dds__Bool__desc);
  const std_msgs_msg_dds__Bool_ no{false};
  EXPECT_TRUE(becomesTrue([&] {
    dds_write(setting, &no);
    return program_->errors().find("another program has set the axes") != std::string::npos;
  }));
  EXPECT_TRUE(exerts(false));
  EXPECT_TRUE(exerts(true)) << program_->errors();
  EXPECT_TRUE(arm_->record().absolute);
}

}  // namespace
}  // namespace hapticd::test
