// SPDX-License-Identifier: Apache-2.0
// The built haptic-bridge between a fake Inverse Service and a peer that commands forces.

#include <gtest/gtest.h>
#include <signal.h>

#include "tests/support/program.h"
#include "tests/support/unused_port.h"
#include "tests/vendor_devices/fake_inverse_service.h"
#include "tests/vendor_devices/peer.h"

namespace hapticd::test {
namespace {

std::vector<std::string> commandFor(const std::string& address, const Peer& peer,
                                    const std::vector<std::string>& more = {}) {
  std::vector<std::string> command{HAPTIC_BRIDGE_PROGRAM, "inverse3", "--address", address, "--peer",
                                   peer.address()};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

/// The program with a service and a peer that commands 1 N.
class Inverse3Program : public testing::Test {
 protected:
  static constexpr std::int64_t kIdleNs = 50'000'000;

  void start(const InverseServiceSettings& settings = {.idle_ns = kIdleNs}) {
    service_ = std::make_unique<FakeInverseService>(settings);
    program_ = std::make_unique<Program>(commandFor(service_->address(), peer_));
  }
  /// Starts, and waits until the hand gets the force.
  void startAndPush() {
    start();
    peer_.command({.force_n = {0, 0, 1}});
    ASSERT_TRUE(exerts(1)) << program_->errors();
  }
  bool exerts(double force_n) {
    return becomesTrue([&] { return std::abs(norm(service_->record().exerted_n) - force_n) < 1e-9; });
  }
  bool says(const std::string& text, std::size_t times = 1) {
    const bool said = becomesTrue([&] {
      const std::string errors = program_->errors();
      std::size_t found = 0;
      for (std::size_t at = errors.find(text); at != std::string::npos; at = errors.find(text, at + 1))
        ++found;
      return found >= times;
    });
    if (!said) ADD_FAILURE() << "not said: " << text << "\n" << program_->errors();
    return said;
  }

  Peer peer_;
  std::unique_ptr<FakeInverseService> service_;
  std::unique_ptr<Program> program_;
};

TEST(Inverse3Address, ThatIsNoneEndsTheProgramAtOnce) {
  const Peer peer;
  for (const char* address :
       {"nowhere", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:65536", "example.org:10001"}) {
    Program program(commandFor(address, peer));
    EXPECT_EQ(program.wait(), exitedWith(64)) << address;
    EXPECT_NE(program.errors().find("--address"), std::string::npos) << program.errors();
    EXPECT_NE(program.errors().find("for example 127.0.0.1:10001"), std::string::npos) << program.errors();
  }
}

TEST_F(Inverse3Program, SaysWhatTheServiceDoesToForces) {
  start({.force_gate_gain = 0.3});
  ASSERT_TRUE(says("inverse3 ready (serial number 049D)"));
  EXPECT_TRUE(says("Inverse Service \"3.5.0.0\", forces written as `vector`"));
  EXPECT_TRUE(says("force gate, gain 0.3; damping 0; gravity compensation on, scaled by 1"));
  EXPECT_TRUE(says("handedness right, preset defaults, basis XYZ"));
  EXPECT_TRUE(says("the force gate counts as 2.3 ms of delay: an estimate"));
}

TEST_F(Inverse3Program, CarriesPlaceGripAndForceAndTheDelayOfTheService) {
  constexpr std::int64_t kAnswerDelayNs = 4'000'000;
  start({.answer_delay_ns = kAnswerDelayNs, .fixed_m = rt::Vec3{0.1, -0.2, 0.3}});
  peer_.command({.force_n = {0, 0, 1}});
  ASSERT_TRUE(exerts(1)) << program_->errors();
  drivers::udp::StatePacket state;
  ASSERT_TRUE(becomesTrue([&] {
    state = peer_.state();
    return !state.fault && state.orientation_in_handle;
  }));
  EXPECT_EQ(state.position_m_in_handle, (rt::Vec3{0.1, -0.2, 0.3}));
  EXPECT_EQ(state.buttons, 5U);
  EXPECT_FALSE(state.drives_torque);
  EXPECT_GE(state.device_latency_ns, 2 * kAnswerDelayNs);
}

TEST_F(Inverse3Program, LeavesTheDeviceWithZeroAndAClearOnSigterm) {
  start({.idle_ns = 3'600'000'000'000});
  peer_.command({.force_n = {0, 0, 1}});
  ASSERT_TRUE(exerts(1));
  program_->signal(SIGTERM);
  EXPECT_EQ(program_->wait(), exitedWith(0)) << program_->errors();
  ASSERT_TRUE(becomesTrue([&] { return service_->record().open_connections == 0; }));
  EXPECT_TRUE(service_->record().zero_before_end);
  EXPECT_TRUE(service_->record().clear_before_end);
  EXPECT_TRUE(service_->record().closed_in_order);
  EXPECT_TRUE(exerts(0));
}

// Nothing is left that could send a zero: only the service's own rule ends the force.
TEST_F(Inverse3Program, LeavesItToTheServiceToDropTheForceWhenItIsKilled) {
  startAndPush();
  program_->signal(SIGKILL);
  program_->wait();
  ASSERT_TRUE(exerts(0));
  EXPECT_FALSE(service_->record().clear_before_end);
  program_ = std::make_unique<Program>(commandFor(service_->address(), peer_));
  EXPECT_TRUE(exerts(1)) << "started again";
}

TEST_F(Inverse3Program, LetsGoWhenHapticdCommandsZero) {
  startAndPush();
  peer_.command({});
  EXPECT_TRUE(exerts(0));
  EXPECT_TRUE(peer_.isHealthy());
}

TEST_F(Inverse3Program, NamesTheKeyFormThatTheServiceIgnoresAndThenRefuses) {
  start({.key = ""});
  service_->setFaults(kIgnoresForces);
  peer_.command({.force_n = {0, 0, 1}});
  EXPECT_TRUE(says("does not follow the forces that are written as set_cursor_force.vector: no force"));
  EXPECT_TRUE(says("does not follow the forces that are written as set_cursor_force.values: no force"));
  EXPECT_TRUE(says("ignores forces written as `vector` and as `values`"));
  EXPECT_EQ(service_->record().most_exerted_n, 0);
}

/// A fault of the service or the device, and what the program says about it.
struct NamedFault {
  std::uint32_t faults;
  const char* text;
};

TEST_F(Inverse3Program, NamesEachFaultOfTheServiceAndGoesOnAfterwards) {
  startAndPush();
  std::size_t ready = 1;
  for (const NamedFault& fault : {
           NamedFault{kUnplugged, "the service has the device no longer"},
           NamedFault{kNotFinite, "are no finite numbers"},
           NamedFault{kMissing, "states in a row could not be used: members are missing"},
           NamedFault{kWrongTypes, "states in a row could not be used"},
           NamedFault{kGarbage, "states in a row could not be used"},
           NamedFault{kJump, "or jump farther than a hand moves"},
           NamedFault{kSilent, "the service does not answer any more"},
           NamedFault{kUnasked, "the service sends states that nobody asked for"},
           NamedFault{kPushes, "N although zero is commanded"},
       }) {
    const std::size_t before = program_->errors().size();
    if (fault.faults == kPushes) peer_.command({});
    service_->setFaults(fault.faults);
    EXPECT_TRUE(becomesTrue([&] { return program_->errors().find(fault.text, before) != std::string::npos; }))
        << fault.text << "\n"
        << program_->errors();
    EXPECT_TRUE(becomesTrue([&] { return !peer_.isHealthy(); })) << fault.text;
    service_->setFaults(0);
    peer_.command({.force_n = {0, 0, 1}});
    EXPECT_TRUE(says("ready (serial number 049D)", ++ready)) << fault.text;
    EXPECT_TRUE(exerts(1)) << fault.text;
  }
  EXPECT_LE(service_->record().most_exerted_n, 1) << "but for what it pushes by itself";
}

TEST_F(Inverse3Program, OpensTheServiceAgainWhenItsConnectionIsLost) {
  startAndPush();
  service_->dropConnections();
  EXPECT_TRUE(becomesTrue([&] { return !peer_.isHealthy(); }));
  EXPECT_TRUE(becomesTrue([&] { return service_->record().connections == 2; }));
  EXPECT_TRUE(exerts(1));
  EXPECT_TRUE(says("Inverse Service at " + service_->address() + ": "));
}

TEST_F(Inverse3Program, WaitsForAServiceThatIsNotThere) {
  const int port = unusedPort();
  program_ = std::make_unique<Program>(commandFor("127.0.0.1:" + std::to_string(port), peer_));
  EXPECT_TRUE(
      says("Connection refused (systemctl status haply-inverse-service; --address names another place)"));
  EXPECT_TRUE(becomesTrue([&] { return peer_.state().header.sequence > 0; })) << "states, with a fault";
  EXPECT_FALSE(peer_.isHealthy());
  program_->signal(SIGTERM);
  EXPECT_EQ(program_->wait(), exitedWith(0));
}

TEST_F(Inverse3Program, RefusesVersionsThatItDoesNotKnow) {
  start({.version = "3.0.9"});
  EXPECT_TRUE(says("its version \"3.0.9\" is too old"));
  service_->setVersion("4.0.0");
  EXPECT_TRUE(says("its version \"4.0.0\" is not known"));
  service_->setVersion("");
  EXPECT_TRUE(says("answers GET /version with status 404"));
  EXPECT_EQ(service_->record().connections, 0U);
}

TEST_F(Inverse3Program, NamesTheDevicesThatAreThereWhereAnotherIsAskedFor) {
  service_ = std::make_unique<FakeInverseService>();
  program_ = std::make_unique<Program>(commandFor(service_->address(), peer_, {"--device", "0000"}));
  EXPECT_TRUE(says("the service has no device \"0000\", but \"049D\", \"04BA\""));
}

TEST_F(Inverse3Program, ExertsNothingFromTheEmergencyBrakeUntilItsRelease) {
  startAndPush();
  ASSERT_TRUE(becomesTrue([&] { return service_->eventListeners() == 1; }));
  service_->sendEvent("device-safety-triggered", "error", R"(,"safety_type":"ebrake_triggered")");
  EXPECT_TRUE(says("the emergency brake is engaged: no force until it is released (as the fake says)"));
  EXPECT_TRUE(exerts(0));
  EXPECT_TRUE(becomesTrue([&] { return peer_.state().fault; }));
  service_->sendEvent("device-safety-triggered", "notice", R"(,"safety_type":"ebrake_released")");
  EXPECT_TRUE(says("the emergency brake is released"));
  EXPECT_TRUE(exerts(1));
  EXPECT_EQ(service_->record().connections, 1U);
}

TEST_F(Inverse3Program, ExertsNothingWithoutPowerAndSaysSo) {
  startAndPush();
  service_->setFaults(kNoPower);
  EXPECT_TRUE(says("the device has no power: no force"));
  EXPECT_TRUE(exerts(0));
  service_->setFaults(0);
  EXPECT_TRUE(says("the device has power"));
  EXPECT_TRUE(exerts(1));
}

TEST_F(Inverse3Program, NamesTheCauseOfEachEventAndOpensTheDeviceAgain) {
  startAndPush();
  struct NamedEvent {
    const char* name;
    const char* data;
    const char* text;
  };
  std::uint64_t connections = 1;
  for (const NamedEvent& event : {
           NamedEvent{"device-disconnected", "", "the device was unplugged"},
           NamedEvent{"device-busy", "", "another session uses the device"},
           NamedEvent{"device-safety-triggered", R"(,"safety_type":"stall_detected")",
                      "a motor of the device"},
           NamedEvent{"device-safety-triggered", R"(,"safety_type":"stability_ceiling")",
                      "limit of its stability"},
           NamedEvent{"device-calibration-failed", R"(,"reason":"pen_asleep")",
                      "calibration failed (pen_asleep: as the fake says)"},
       }) {
    ASSERT_TRUE(becomesTrue([&] { return service_->eventListeners() == 1; }));
    service_->sendEvent(event.name, "warning", event.data, FakeInverseService::kOtherDevice);
    service_->sendEvent(event.name, "warning", event.data);
    EXPECT_TRUE(says(event.text));
    ++connections;
    EXPECT_TRUE(becomesTrue([&] { return service_->record().connections >= connections; })) << event.text;
    EXPECT_TRUE(exerts(1)) << event.text;
  }
}

}  // namespace
}  // namespace hapticd::test
