// SPDX-License-Identifier: Apache-2.0
#include "tests/system/support/slurm_cluster.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <netinet/in.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>

#include "tests/support/unused_port.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

const std::string kMunged = unpackedProgram("munged");
const std::string kSlurmctld = unpackedProgram("slurmctld");
const std::string kSlurmd = unpackedProgram("slurmd");
const std::string kSlurmstepd = unpackedProgram("slurmstepd");

std::string randomBytes(std::size_t count) {
  std::random_device random;
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

/// The IPv4 address that this machine's name stands for, if it is a loopback one (127.0.0.0/8).
std::optional<std::string> loopbackAddressOfName() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return std::nullopt;
  addrinfo hints{};
  hints.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (::getaddrinfo(name.data(), nullptr, &hints, &found) != 0) return std::nullopt;
  const in_addr address = reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr;
  ::freeaddrinfo(found);
  if (::ntohl(address.s_addr) >> 24 != IN_LOOPBACKNET) return std::nullopt;
  std::array<char, INET_ADDRSTRLEN> text{};
  return ::inet_ntop(AF_INET, &address, text.data(), text.size());
}

void end(std::unique_ptr<Program>& daemon) {
  if (!daemon) return;
  daemon->signal(SIGTERM);
  daemon->wait();
  daemon.reset();
}

}  // namespace

std::string SlurmCluster::obstacle() {
  const std::array programs{kMunged, kSlurmctld, kSlurmd, kSlurmstepd, unpackedProgram("sbatch")};
  if (std::ranges::any_of(programs, &std::string::empty))
    return "Debian's packages munge and slurm-wlm are not unpacked";
  if (!loopbackAddressOfName()) return "the name of this machine has no loopback address in /etc/hosts";
  return "";
}

SlurmCluster::SlurmCluster() {
  for (const char* name : {"state", "spool"}) fs::create_directory(folder_.path() / name);
  const fs::path key = folder_.write("munge.key", randomBytes(1024));
  fs::permissions(key, fs::perms::owner_read);
  folder_.write("slurm.conf", configuration());
  // before /usr/bin, for what jobs and tools/slurm call
  options_.environment = {"SLURM_CONF=" + inFolder("slurm.conf"),
                          std::string("PATH=" HAPTICD_UNPACKED_PROGRAMS ":/usr/bin:/bin")};
  // --force: the folder may be in one that anybody can write to
  munged_ = std::make_unique<Program>(
      std::vector<std::string>{kMunged, "--foreground", "--force", "--key-file=" + key.string(),
                               "--socket=" + inFolder("munge.socket"), "--pid-file=" + inFolder("munge.pid"),
                               "--seed-file=" + inFolder("munge.seed"), "--num-threads=2"},
      options_);
  EXPECT_TRUE(becomesTrue([this] { return fs::exists(inFolder("munge.socket")); })) << munged_->errors();
  slurmctld_ = std::make_unique<Program>(std::vector<std::string>{kSlurmctld, "-D"}, options_);
  slurmd_ = std::make_unique<Program>(
      std::vector<std::string>{kSlurmd, "-D", "-N", "node", "-d", kSlurmstepd}, options_);
}

SlurmCluster::~SlurmCluster() {
  // a job's process is no child of slurmd, which would leave it running
  run({unpackedProgram("scancel"), "--full", fmt::format("--user={}", ::getuid())});
  EXPECT_TRUE(becomesTrue([this] { return isIdle(); })) << "jobs do not end";
  end(slurmd_);
  end(slurmctld_);
  end(munged_);
}

std::string SlurmCluster::configuration() const {
  return fmt::format(
      "ClusterName=test\n"
      "SlurmctldHost=localhost({address})\n"
      "SlurmctldPort={}\n"
      "SlurmdPort={}\n"
      "CommunicationParameters=NoInAddrAny,NoCtldInAddrAny\n"
      "SlurmUser={}\n"
      "SlurmdUser={}\n"
      "AuthType=auth/munge\n"
      "AuthInfo=socket={folder}/munge.socket\n"
      "StateSaveLocation={folder}/state\n"
      "SlurmdSpoolDir={folder}/spool\n"
      "SlurmctldPidFile={folder}/slurmctld.pid\n"
      "SlurmdPidFile={folder}/slurmd.pid\n"
      "ProctrackType=proctrack/pgid\n"
      "TaskPlugin=task/none\n"
      "{plugin_dir}"
      "MailProg=/bin/true\n"
      "SelectType=select/cons_tres\n"
      "SelectTypeParameters=CR_CPU\n"
      "SchedulerType=sched/builtin\n"
      "SchedulerParameters=batch_sched_delay=0,sched_interval=1\n"
      "KillWait=1\n"
      "ReturnToService=2\n"
      "NodeName=node NodeHostname=localhost NodeAddr={address} CPUs=2\n"
      "PartitionName=all Nodes=node Default=YES State=UP\n",
      unusedPort(), unusedPort(), ::getuid(), ::getuid(), fmt::arg("folder", folder_.path().string()),
      fmt::arg("address", loopbackAddressOfName().value()),
      fmt::arg("plugin_dir",
               fs::exists(HAPTICD_SLURM_PLUGINS) ? "PluginDir=" HAPTICD_SLURM_PLUGINS "\n" : ""));
}

Finished SlurmCluster::run(const std::vector<std::string>& command) const {
  return runToEnd(command, options_);
}

bool SlurmCluster::isReady() const {
  const bool ready = becomesTrue([this] {
    return run({unpackedProgram("sinfo"), "--noheader", "--format=%T"}).output == "idle\n";
  });
  EXPECT_TRUE(ready) << munged_->errors() << slurmctld_->errors() << slurmd_->errors();
  return ready;
}

bool SlurmCluster::isIdle() const {
  const Finished queue = run({unpackedProgram("squeue"), "--noheader"});
  return queue.ending != exitedWith(0) || queue.output.empty();
}

std::vector<std::string> processesWithInEnvironment(const std::string& text) {
  std::vector<std::string> processes;
  for (const fs::directory_entry& entry : fs::directory_iterator("/proc")) {
    std::ifstream stream(entry.path() / "environ", std::ios::binary);
    const std::string environment{std::istreambuf_iterator<char>(stream), {}};
    if (environment.find(text) != std::string::npos) processes.push_back(entry.path().filename().string());
  }
  return processes;
}

}  // namespace hapticd::test
