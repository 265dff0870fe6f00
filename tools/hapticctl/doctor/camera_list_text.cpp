// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tools/hapticctl/doctor/camera_list.h"

namespace hapticd::tools {
namespace {

std::string lineOf(const ConnectedCamera& camera) {
  std::string text = fmt::format("{:<9} {}: {}", rt::wordOf(camera.suitability), camera.place, camera.name);
  if (!camera.serial.empty()) text += ", serial number " + camera.serial;
  if (!camera.format.empty()) text += ", depth in " + camera.format;
  if (!camera.note.empty()) text += fmt::format(" ({})", camera.note);
  return text + "\n";
}

}  // namespace

std::string textOf(const CameraList& list) {
  std::string text;
  for (const ConnectedCamera& camera : list.cameras) text += lineOf(camera);
  if (list.cameras.empty()) text += "no camera is connected\n";
  return text + (list.problem.empty() ? fmt::format("hapticd takes its depth from {}\n", list.source)
                                      : fmt::format("hapticd finds no camera: {}\n", list.problem));
}

std::string jsonOf(const CameraList& list) {
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array();
  for (const ConnectedCamera& camera : list.cameras) {
    cameras.push_back({{"suitability", rt::wordOf(camera.suitability)},
                       {"name", camera.name},
                       {"place", camera.place},
                       {"driver", camera.driver},
                       {"serial", camera.serial},
                       {"format", camera.format},
                       {"note", camera.note}});
  }
  return nlohmann::ordered_json{{"cameras", cameras}, {"source", list.source}, {"problem", list.problem}}
             .dump(2, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
}

}  // namespace hapticd::tools
