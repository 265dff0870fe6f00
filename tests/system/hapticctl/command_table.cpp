// SPDX-License-Identifier: Apache-2.0
#include "tests/system/hapticctl/command_table.h"

#include <sstream>

namespace hapticd::test {

const std::vector<Call> kCalls{
    {{"status"}, Does::read},
    {{"status", "--all"}, Does::read},
    {{"watch", "--count", "1"}, Does::read},
    {{"events"}, Does::read},
    {{"metrics"}, Does::read},
    {{"version"}, Does::read},
    {{"get"}, Does::read},
    {{"params"}, Does::read},
    {{"set", "force.radius_m=0.03"}},
    {{"engage"}},
    {{"disengage"}},
    {{"undo"}},
    {{"reload"}},
    {{"save", "soft"}},
    {{"load", "soft"}},
    {{"profiles"}, Does::read},
    {{"profiles", "--boot", "soft"}},
    {{"profiles", "--no-boot"}},
    {{"profiles", "--delete", "soft"}},
    {{"fixture", "add", "nerve", "--kind", "sphere", "--position-m", "0,0,-0.8", "--radius-m", "0.05"}},
    {{"fixture", "list"}, Does::read},
    {{"fixture", "show", "nerve"}, Does::read},
    {{"fixture", "change", "nerve", "--radius-m", "0.06"}},
    {{"fixture", "disable", "nerve"}},
    {{"fixture", "enable", "nerve"}},
    {{"fixture", "touch", "wall", "--kind", "plane", "--touched", "TOUCHED"}},
    {{"fixture", "export"}, Does::read},
    {{"fixture", "import", "SCENE"}},
    {{"fixture", "remove", "vein"}},
    {{"region", "add", "liver", "--shape", "sphere", "--position-m", "0,0,-1", "--radius-m", "0.05",
      "--stiffness-n-per-m", "300"}},
    {{"region", "list"}, Does::read},
    {{"region", "show", "liver"}, Does::read},
    {{"region", "change", "liver", "--friction", "0.1"}},
    {{"region", "stiffness", "liver", "400"}},
    {{"region", "export"}, Does::read},
    {{"region", "import", "SCENE"}},
    {{"region", "remove", "lung"}},
    {{"frame", "list"}, Does::read},
    {{"trace", "start"}},
    {{"trace", "mark", "begin"}},
    {{"trace", "stop"}},
    {{"trace", "dump"}},
    {{"trace", "list"}, Does::read},
    {{"trace", "note", "TRACE", "good"}},
    {{"trace", "keep", "TRACE"}},
    {{"trace", "keep", "--undo", "TRACE"}},
    {{"trace", "delete", "TRACE"}},
    {{"snapshot"}, Does::read},
    {{"register", "--points", "PAIRS"}},
    {{"register", "--show"}, Does::read},
    {{"register", "--reset"}},
    {{"calibrate"}, Does::read}};

std::string textOf(const Command& command) {
  std::string text;
  for (const std::string& word : command) text += (text.empty() ? "" : " ") + word;
  return text;
}

void writeCommandFiles(const DaemonHome& home) {
  home.write("pairs.csv",
             "name,camera_x_m,camera_y_m,camera_z_m,world_x_m,world_y_m,world_z_m\n"
             "a,0,0,-1,0,0,-1\nb,0.3,0,-1,0.3,0,-1\nc,0,0.3,-1,0,0.3,-1\n");
  home.write("scene.yaml",
             "fixtures: [{name: vein, kind: sphere, position_m: [0, 0, -1], radius_m: 0.05}]\n"
             "regions: [{name: lung, shape: sphere, position_m: [0, 0, -1], radius_m: 0.05}]\n");
  home.write("touched.txt", "0 0 -1\n0.1 0 -1\n0.1 0.1 -1\n0 0.1 -1\n");
}

namespace {

std::string newestTrace(const DaemonHome& home) {
  std::istringstream names(home.control({"trace", "list", "--names", "--sort", "time"}).output);
  std::string newest = "none";
  for (std::string name; std::getline(names, name);) newest = name;
  return newest;
}

}  // namespace

Command completedCommand(const DaemonHome& home, Command command) {
  for (std::string& word : command) {
    if (word == "PAIRS") word = home.path() / "pairs.csv";
    if (word == "SCENE") word = home.path() / "scene.yaml";
    if (word == "TOUCHED") word = home.path() / "touched.txt";
    if (word == "TRACE") word = newestTrace(home);
  }
  return command;
}

}  // namespace hapticd::test
