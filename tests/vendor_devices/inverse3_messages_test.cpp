// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tools/haptic-bridge/inverse3/service_link.h"
#include "tools/haptic-bridge/inverse3/service_messages.h"

// Texts and decisions of the driver of the Inverse3, without sockets.
namespace hapticd::tools::inverse3 {
namespace {

using Verdict = EchoCheck::Verdict;

KeyForm formFor(const std::string& version) {
  return *keyFormOf(*versionFrom(R"({"project_version":")" + version + "\"}"));
}
bool refuses(const std::string& version) {
  return !keyFormOf(*versionFrom(R"({"project_version":")" + version + "\"}"));
}

TEST(InverseServiceVersion, DecidesHowForcesAreWritten) {
  EXPECT_EQ(formFor("3.1.0"), KeyForm::values);
  EXPECT_EQ(formFor("3.4.12.1"), KeyForm::values);
  EXPECT_EQ(formFor("3.5.0.0"), KeyForm::vector);
  EXPECT_EQ(formFor("v3.5"), KeyForm::vector);
  EXPECT_EQ(formFor("3.12.0"), KeyForm::vector) << "a number, not a text";
  for (const char* version : {"3.0.9", "2.1", "4.0.0", "11.0"}) EXPECT_TRUE(refuses(version)) << version;
}

TEST(InverseServiceVersion, IsFoundInEachShapeOfTheAnswer) {
  EXPECT_EQ(versionFrom(R"({"ok":true,"data":{"git_tag":"3.5.0"}})")->minor, 5);
  EXPECT_EQ(versionFrom(R"({"ok":true,"data":"3.4.1"})")->minor, 4);
  EXPECT_EQ(versionFrom(R"({"project_version":"main","git_describe":"3.5.1-2-gce34c39e"})")->minor, 5);
  for (const char* body : {"", "[]", "3.5", R"({"data":7})", R"({"git_tag":"main"})", R"({"git_tag":"3"})"})
    EXPECT_FALSE(versionFrom(body)) << body;
}

TEST(InverseServiceAddress, IsNumericSoThatNoNameServerHoldsTheProgramUp) {
  EXPECT_EQ(serviceEndpointFrom("localhost:10001")->text(), "127.0.0.1:10001");
  EXPECT_EQ(serviceEndpointFrom("192.0.2.7:9")->text(), "192.0.2.7:9");
  for (const char* text : {"", "10001", "127.0.0.1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:65536",
                           "example.org:1", "127.0.0.1:1x"})
    EXPECT_FALSE(serviceEndpointFrom(text)) << text;
}

TEST(InverseServiceFrames, HoldTheForceInTheKeyAskedFor) {
  for (const KeyForm form : {KeyForm::values, KeyForm::vector}) {
    const FrameWriter writer("04\"9D", form);
    const nlohmann::json frame = nlohmann::json::parse(writer.force({1.5, -0.25, 1e-9}));
    const nlohmann::json expected{
        {"inverse3",
         {{{"device_id", "04\"9D"},
           {"commands",
            {{"set_cursor_force", {{nameOf(form), {{"x", 1.5}, {"y", -0.25}, {"z", 1e-9}}}}}}}}}}};
    EXPECT_EQ(frame, expected);
    EXPECT_TRUE(nlohmann::json::parse(writer.clear()).at("inverse3").at(0).at("commands").contains("clear"));
  }
}

TEST(InverseServiceStates, AreTakenOnlyWithWhatIsNeeded) {
  const std::string good =
      R"({"inverse3":[7,{"device_id":"A","state":{"cursor_position":{"x":1,"y":2,"z":3},)"
      R"("current_cursor_force":{"x":0,"y":0,"z":0.5}}}]})";
  const auto state = stateFrom(good, "A");
  ASSERT_TRUE(state);
  EXPECT_EQ(state->position_m, (rt::Vec3{1, 2, 3}));
  EXPECT_EQ(state->echoed_force_n, (rt::Vec3{0, 0, 0.5}));
  EXPECT_FALSE(state->velocity_m_per_s);
  EXPECT_FALSE(state->orientation);
  EXPECT_EQ(stateFrom(good, "B").error(), StateFault::absent);
  // each part of the text that is lost, and each that is changed, is an error at most
  for (std::size_t i = 0; i < good.size(); ++i) {
    (void)stateFrom(good.substr(0, i), "A");
    for (const char* other : {"[", "{", "\"", "null", "-", "\xff"})
      (void)stateFrom(good.substr(0, i) + other + good.substr(i + 1), "A");
  }
  EXPECT_EQ(stateFrom(std::string(100'000, '['), "A").error(), StateFault::malformed);
  std::string text = good;
  EXPECT_FALSE(stateFrom(text.replace(text.find("\"x\":1"), 5, "\"x\":1e999"), "A"));
}

TEST(InverseServiceStates, HaveTheGripsOrientationAsAUnitQuaternion) {
  const auto stateWith = [](const std::string& grip) {
    return *stateFrom(R"({"inverse3":[{"device_id":"A","state":{"cursor_position":{"x":1,"y":2,"z":3},)"
                      R"("current_cursor_force":{"x":0,"y":0,"z":0}}}],)" +
                          grip + "}",
                      "A");
  };
  const DeviceState wired =
      stateWith(R"("verse_grip":[{"state":{"button":true,"orientation":{"w":0.71,"x":0.71,"y":0,"z":0}}}])");
  ASSERT_TRUE(wired.orientation);
  EXPECT_NEAR(wired.orientation->x, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(wired.orientation->w, std::sqrt(0.5), 1e-15);
  EXPECT_EQ(wired.buttons, 1U);
  const DeviceState wireless =
      stateWith(R"("verse_grip":[],"wireless_verse_grip":[{"state":{"buttons":{"c":true,"a":false,"b":true},)"
                R"("orientation":{"w":1,"x":0,"y":0,"z":0}}}])");
  EXPECT_EQ(wireless.buttons, 6U) << "a, b, c";
  EXPECT_FALSE(
      stateWith(R"("verse_grip":[{"state":{"orientation":{"w":0,"x":0,"y":0,"z":0}}}])").orientation);
}

TEST(ForceGate, CountsAsAFilterOfFirstOrder) {
  EXPECT_EQ(gateDelayEstimateNs({}), 0);
  EXPECT_EQ(gateDelayEstimateNs({.force_gate_gain = 1}), 0);
  // the mean delay of y += g (x - y) is (1 - g) / g steps of 1 ms
  EXPECT_NEAR(static_cast<double>(gateDelayEstimateNs({.force_gate_gain = 0.3})), 0.7 / 0.3 * 1e6, 1);
  EXPECT_NEAR(static_cast<double>(gateDelayEstimateNs({.force_gate_gain = 0.0})), 99e6, 1);
}

/// `count` answers to a command of `force_n`, each of which is that command times `share`.
void feed(EchoCheck& check, const rt::Vec3& force_n, double share, int count) {
  for (int i = 0; i < count; ++i) check.add(force_n, share * force_n, 0);
}

TEST(EchoCheck, AllowsNothingUntilTheServiceIsQuietAndLittleUntilItFollows) {
  EchoCheck check;
  EXPECT_EQ(check.most_n(10), 0);
  feed(check, {}, 0, EchoCheck::kNeeded);
  EXPECT_TRUE(check.isQuiet());
  EXPECT_EQ(check.most_n(10), EchoCheck::kUnproven_n);
  feed(check, {0, 0, 0.1}, 0.3, static_cast<int>(EchoCheck::kLag) - 1 + EchoCheck::kNeeded - 1);
  EXPECT_EQ(check.most_n(10), EchoCheck::kUnproven_n);
  feed(check, {0, 0, 0.1}, 0.3, 1);
  EXPECT_EQ(check.verdict(), Verdict::proven);
  EXPECT_EQ(check.most_n(10), 10);
}

TEST(EchoCheck, IsNotPassedByAServiceThatIgnoresTheKeyOrAnswersWithSomethingElse) {
  for (const rt::Vec3 echo_n :
       {rt::Vec3{}, rt::Vec3{0, 0, -0.1}, rt::Vec3{0.1, 0, 0.02}, rt::Vec3{0, 0, 5}}) {
    EchoCheck check;
    feed(check, {}, 0, EchoCheck::kNeeded);
    for (int i = 0; i < static_cast<int>(EchoCheck::kLag) + EchoCheck::kPatience; ++i) {
      check.add({0, 0, 0.1}, echo_n, 0);
      EXPECT_NE(check.verdict(), Verdict::proven) << echo_n.z;
    }
    EXPECT_EQ(check.verdict(), Verdict::ignored) << echo_n.z;
    EXPECT_EQ(check.most_n(10), 0);
  }
}

TEST(EchoCheck, SaysNothingAboutForcesThatAreTooSmall) {
  EchoCheck check;
  feed(check, {}, 0, EchoCheck::kNeeded);
  feed(check, {0.02, 0, 0}, 0, 1000);
  EXPECT_EQ(check.verdict(), Verdict::unproven);
  for (int i = 0; i < 1000; ++i) feed(check, i % 2 == 0 ? rt::Vec3{} : rt::Vec3{0.1, 0, 0}, 0, 1);
  EXPECT_EQ(check.verdict(), Verdict::unproven) << "the answer may be that to the zero before";
}

TEST(EchoCheck, NoticesAServiceThatPushesWithoutACommand) {
  EchoCheck check;
  for (int i = 0; i < EchoCheck::kPatience; ++i) check.add({}, {0.5, 0, 0}, 0);
  EXPECT_EQ(check.verdict(), Verdict::pushes);
  EXPECT_FALSE(check.isQuiet());
  EchoCheck damped;
  for (int i = 0; i < EchoCheck::kPatience; ++i) damped.add({}, {0.5, 0, 0}, 0.6);
  EXPECT_TRUE(damped.isQuiet()) << "as much as the service's own damping exerts";
}

TEST(EchoCheck, AcceptsAnswersThatAreAFewFramesLateAndFiltered) {
  EchoCheck check;
  feed(check, {}, 0, EchoCheck::kNeeded);
  rt::Vec3 filtered_n;
  for (int i = 0; i < 2000; ++i) {
    // a wall that is pressed with a tremor
    const rt::Vec3 commanded_n{0, 0.2 * std::sin(0.06 * i), 2 + 0.5 * std::sin(0.05 * i)};
    check.add(commanded_n, filtered_n, 0);
    filtered_n = filtered_n + 0.3 * (commanded_n - filtered_n);
    EXPECT_NE(check.verdict(), Verdict::ignored);
  }
  EXPECT_EQ(check.verdict(), Verdict::proven);
}

ServiceEvent safety(const std::string& type, const std::string& level = "warning",
                    const std::string& device = "A") {
  return {.name = "device-safety-triggered",
          .level = level,
          .device_id = device,
          .safety_type = type,
          .reason = "",
          .message = "x\n"};
}

TEST(SafetyWatch, HoldsForcesWhileTheBrakeIsEngagedOrADangerLasts) {
  SafetyWatch watch("A");
  EXPECT_FALSE(watch.holds());
  const Finding brake = watch.takeEvent(safety("ebrake_triggered", "error"));
  EXPECT_TRUE(brake.text.starts_with("the emergency brake is engaged"));
  EXPECT_EQ(brake.text.find('\n'), std::string::npos) << "what comes from outside is printable";
  EXPECT_FALSE(brake.ends);
  EXPECT_TRUE(watch.holds());
  watch.takeEvent(safety("fod_stage_changed"));
  watch.takeEvent(safety("ebrake_released", "notice"));
  EXPECT_TRUE(watch.holds()) << "the other one lasts";
  watch.takeEvent(safety("fod_stage_changed", "info"));
  EXPECT_FALSE(watch.holds());
}

TEST(SafetyWatch, EndsWithWhatHasNoEndOfItsOwnAndIgnoresOtherDevices) {
  SafetyWatch watch("A");
  for (const char* type : {"stall_detected", "stability_ceiling", "something_new"})
    EXPECT_TRUE(watch.takeEvent(safety(type)).ends) << type;
  for (const char* name :
       {"device-disconnected", "device-busy", "device-calibration-failed", "device-connection-loop"}) {
    EXPECT_TRUE(watch.takeEvent({.name = name, .device_id = "A"}).ends) << name;
    EXPECT_FALSE(watch.takeEvent({.name = name, .device_id = "B"}).ends) << name;
  }
  EXPECT_TRUE(watch.takeEvent({.name = "device-busy"}).ends) << "no device named: it may be ours";
  EXPECT_FALSE(watch.takeEvent(safety("ebrake_triggered", "error", "B")).ends);
  EXPECT_FALSE(watch.holds());
  EXPECT_TRUE(watch.takeEvent({.name = "device-connected", .device_id = "A"}).text.empty());
}

TEST(EventTexts, AreReadOrRefused) {
  const auto event = eventFrom(
      R"({"name":"n","level":"l","data":{"device_id":"A","safety_type":"s","reason":"r"},"message":"m"})");
  ASSERT_TRUE(event);
  EXPECT_EQ(event->safety_type + event->reason + event->message + event->device_id + event->level, "srmAl");
  for (const char* text : {"", "[]", "{", R"({"name":7})", R"({"level":"info"})"})
    EXPECT_FALSE(eventFrom(text)) << text;
}

}  // namespace
}  // namespace hapticd::tools::inverse3
