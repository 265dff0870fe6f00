// SPDX-License-Identifier: Apache-2.0
#include "tests/system/fake_replies.h"

#include <string_view>

namespace hapticd::test {
namespace {

using nlohmann::json;

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr int kNoMeasurement = 2047;

const json kLatency{{"p50Ns", 3100}, {"p99Ns", 8000}, {"p999Ns", 12000}, {"maxNs", 4'560'000}};
const json kPose{{"xM", 0}, {"yM", 0}, {"zM", 0}, {"rollRad", 0}, {"pitchRad", 0}, {"yawRad", 0}};

json vector(double x, double y, double z) {
  return {{"x", x}, {"y", y}, {"z", z}};
}

std::string base64(const std::string& bytes) {
  static constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * k) & 63U];
    }
  }
  return text;
}

json parameterRow(const std::string& name, double value, const std::string& unit) {
  return {{"name", name},     {"value", value}, {"kind", "number"},  {"unit", unit},
          {"minimum", 0},     {"maximum", 1},   {"choices", json()}, {"default", value},
          {"effect", "live"}, {"symbol", ""},   {"help", "a number"}};
}

json window() {
  return {{"ticks", 200},
          {"contactTicks", 100},
          {"minForceN", 0.5},
          {"maxForceN", 1.5},
          {"maxWakeupLatencyNs", 9000}};
}

json snapshotHeader() {
  return {{"frame", 7},
          {"width", kWidth},
          {"height", kHeight},
          {"depthModel",
           {{"aPerM", -0.003071102},
            {"bPerM", 3.330949516},
            {"fxPx", 594.214342},
            {"fyPx", 591.040537},
            {"cxPx", 339.307810},
            {"cyPx", 242.739138},
            {"nearM", 0.4},
            {"farM", 4.0}}},
          {"cameraPose", kPose},
          {"tick", goodStatus()["tick"]}};
}

}  // namespace

json goodStatus() {
  return {{"mode", "engaged"},
          {"cause", "requested"},
          {"warnings", json::array()},
          {"uptimeS", 61.5},
          {"version", "0.1.0"},
          {"kernel", "6.1.0-50-rt-amd64"},
          {"loop",
           {{"rateHz", 999.9},
            {"realtimeScheduling", true},
            {"memoryLocked", true},
            {"cpu", 3},
            {"wakeupLatency", kLatency},
            {"computeTime", kLatency},
            {"counters", {{"ticks", 61500}, {"overruns", 2}, {"skippedPeriods", 1}, {"contactTicks", 400}}},
            {"transitions", {{"count", 3}, {"byCause", {{"requested", 2}, {"no_scene", 1}}}}},
            {"traceTicksDropped", 0},
            {"pageFaults", 0}}},
          {"tick",
           {{"hipMInWorld", vector(0.1, -0.02, -0.8)},
            {"proxyMInWorld", vector(0.1, -0.02, -0.79)},
            {"lawForceNInWorld", vector(0, 0, 6)},
            {"commandForceNInWorld", vector(3, 0, 4)},
            {"pointsUsed", 57},
            {"sceneAgeNs", 17'000'000},
            {"stiffnessLimitNPerM", 900},
            {"surfaceNoiseM", 0.0001}}},
          {"stiffness",
           {{"ceilingNPerM", 1000},
            {"stabilityNPerM", 900},
            {"deviceNPerM", 400},
            {"noiseNPerM", 700},
            {"slewNPerM", nullptr},
            {"surfaceStepM", nullptr},
            {"noiseFrames", 100}}},
          {"camera",
           {{"state", "streaming"},
            {"detail", ""},
            {"identity", "freenect A1"},
            {"frames", 1800},
            {"damagedFrames", 0},
            {"lostFrames", 0},
            {"advice", ""},
            {"details", nullptr}}},
          {"scene", {{"frameRateHz", 29.9}, {"points", 4000}, {"lastModelNs", 122'000}}},
          {"handle",
           {{"state", "present"},
            {"detail", ""},
            {"identity", "simulated"},
            {"exertsForce", true},
            {"measurements", 61500},
            {"threadPriority", 79},
            {"lastHop", kLatency}}},
          {"law", {{"chosen", "surface"}, {"reason", "the cheapest that is accurate enough"}}},
          {"leds", {{"state", "none"}}},
          {"trace",
           {{"state", "writing"},
            {"detail", ""},
            {"name", "2026-03-04T05-06-07Z-test"},
            {"bytes", 12'300'000},
            {"durationS", 57},
            {"ticksLost", 0},
            {"traces", 4},
            {"freeBytes", 5'000'000'000}}}};
}

json statusWith(const json& patch) {
  json status = goodStatus();
  status.merge_patch(patch);
  return status;
}

void answerAsAnOldDaemon(FakeDaemon& daemon) {
  const json mode{{"mode", "engaged"}, {"cause", "requested"}};
  json status = goodStatus();
  for (const char* newer : {"version", "kernel", "trace", "stiffness"}) status.erase(newer);
  daemon.answer("org.varlink.service.GetInfo", json{{"version", "0.0.9"}});
  daemon.answer("io.hapticd.Status.GetStatus", json{{"status", status}});
  daemon.answer("io.hapticd.Status.GetParameters",
                json{{"parameters", {parameterRow("force.radius_m", 0.04, "m")}}});
  daemon.answer("io.hapticd.Status.Monitor",
                FakeAnswer{.replies = {{{"status", status}, {"window", window()}, {"droppedCount", 0}}},
                           .endless = true});
  daemon.answer("io.hapticd.Control.SetParameters", json{{"generation", 2}});
  daemon.answer("io.hapticd.Control.Engage", mode);
  daemon.answer("io.hapticd.Control.Disengage", json{{"mode", "idle"}, {"cause", "requested"}});
}

void answerEverything(FakeDaemon& daemon) {
  answerAsAnOldDaemon(daemon);
  daemon.answer("org.varlink.service.GetInfo", json{{"version", "0.1.0"}});
  daemon.answer("io.hapticd.Status.GetStatus", json{{"status", goodStatus()}});
  daemon.answer("io.hapticd.Status.Monitor",
                FakeAnswer{.replies = {{{"status", goodStatus()}, {"window", window()}, {"droppedCount", 0}}},
                           .endless = true});
  const json event{{"number", 1},           {"timeNs", 1'772'600'767'123'000'000},
                   {"kind", "camera"},      {"text", "camera lost"},
                   {"priority", "warning"}, {"fields", json::object()}};
  daemon.answer("io.hapticd.Status.Events",
                FakeAnswer{.replies = {{{"event", event}, {"droppedCount", 0}}}, .endless = true});
  daemon.answer("io.hapticd.Control.ClearFault", json{{"mode", "idle"}, {"cause", "requested"}});
  const json name{{"name", "2026-03-04T05-06-07Z"}};
  for (const char* method : {"StartTrace", "StopTrace", "DumpTrace", "MarkTrace"}) {
    daemon.answer(std::string("io.hapticd.Control.") + method, name);
  }
  for (const char* method : {"DeleteTrace", "KeepTrace", "NoteTrace", "DeleteProfile", "SetBootProfile"}) {
    daemon.answer(std::string("io.hapticd.Control.") + method, json::object());
  }
  daemon.answer("io.hapticd.Status.ListTraces",
                json{{"traces", json::array()}, {"folder", "/var/lib/hapticd/traces"}});
  daemon.answer("io.hapticd.Control.Reload", json{{"changes", {"sets force.radius_m from 0.04 to 0.03"}},
                                                  {"waiting", json::array()},
                                                  {"hidden", json::array()},
                                                  {"pending", nullptr}});
  daemon.answer("io.hapticd.Control.SaveProfile", json{{"name", "soft"}});
  daemon.answer("io.hapticd.Control.LoadProfile", json{{"generation", 3}, {"changed", {"force.radius_m"}}});
  daemon.answer("io.hapticd.Status.ListFixtures", json{{"generation", 3},
                                                       {"fixtures",
                                                        {{{"name", "nerve"},
                                                          {"origin", "client"},
                                                          {"definition",
                                                           {{"name", "nerve"},
                                                            {"kind", "sphere"},
                                                            {"position_m", {0, 0, -0.8}},
                                                            {"radius_m", 0.05},
                                                            {"stiffness_n_per_m", 300},
                                                            {"max_force_n", 2}}},
                                                          {"enabled", true},
                                                          {"inContact", false},
                                                          {"nearest", true},
                                                          {"distanceM", 0.0032}}}}});
  daemon.answer("io.hapticd.Status.ListRegions", json{{"generation", 4},
                                                      {"regions",
                                                       {{{"name", "liver"},
                                                         {"definition",
                                                          {{"name", "liver"},
                                                           {"place", "shape"},
                                                           {"shape", "sphere"},
                                                           {"model", "linear"},
                                                           {"stiffness_n_per_m", 300}}},
                                                         {"inContact", true}}}}});
  for (const char* method : {"ChangeFixtures", "ChangeRegions", "SetStiffness"}) {
    daemon.answer(std::string("io.hapticd.Control.") + method, json{{"generation", 5}});
  }
  daemon.answer(
      "io.hapticd.Status.ListProfiles",
      json{{"profiles", {{{"name", "soft"}, {"boot", true}, {"timeNs", 1'772'600'767'000'000'000}}}}});
  daemon.answer(
      "io.hapticd.Status.GetCalibration",
      json{{"calibration", {{"cameraPose", kPose}, {"source", "configuration"}, {"waiting", json()}}}});
  daemon.answer("io.hapticd.Control.SetCalibration", json{{"restartRequired", true}});
  daemon.answer("io.hapticd.Status.GetSnapshot", snapshotOfAWall(760, 120));
}

FakeAnswer snapshotOfAWall(int raw, int rows_per_reply) {
  FakeAnswer answer;
  for (int first = 0; first < kHeight; first += rows_per_reply) {
    std::string bytes;
    for (int row = first; row < first + rows_per_reply; ++row) {
      const int value = row == 0 ? kNoMeasurement : raw;
      for (int column = 0; column < kWidth; ++column) {
        bytes += static_cast<char>(value & 0xff);
        bytes += static_cast<char>(value >> 8);
      }
    }
    json reply{{"firstRow", first}, {"rows", base64(bytes)}};
    if (first == 0) reply["header"] = snapshotHeader();
    answer.replies.push_back(std::move(reply));
  }
  return answer;
}

}  // namespace hapticd::test
