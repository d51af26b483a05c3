// weft-rig: serves the emulated rig of a rig file on real ports, in real time, until it is stopped.

#include <CLI/CLI.hpp>
#include <iostream>

#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/apps/weft_rig/rig_server.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/loop/threads.hpp"
#include "daemon/campaign/bench_session.hpp"

namespace {

using namespace weft;
using namespace weft::daemon;

struct Args {
  std::filesystem::path rig;
  std::uint64_t seed = 1;
  std::uint16_t tcp_from = 0;  ///< first TCP port; 0: ports of the rig file only
};

Status serve(const Args& args) {
  const Result<std::string> text = read_text_file(args.rig);
  if (!text) return pass(text.error());
  Result<RigFile> rig = parse_rig_file(*text);
  if (!rig) return pass(rig.error(), args.rig.string());
  if (args.tcp_from != 0) serve_on_tcp_too(*rig, args.tcp_from);
  const Result<std::string> fabrics = read_fabrics(*rig, args.rig);
  if (!fabrics) return pass(fabrics.error());
  RealLoop loop;
  const cli::StopSignals signals;
  const RealTimeScope real_time;
  if (!real_time.advice().empty()) std::cerr << "weft-rig: " << real_time.advice() << "\n";
  const auto server = RigServer::create(loop, *rig, *fabrics, args.seed);
  if (!server) return pass(server.error(), args.rig.string());
  std::cout << "SIMULATED rig " << rig->name << ", seed " << args.seed << "\n";
  for (const std::string& line : (*server)->lines()) std::cout << "  " << line << "\n";
  std::cout << "ready" << std::endl;
  loop.run_until([&] { return signals.requested().load(std::memory_order_relaxed); });
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Serves the emulated rig of a rig file on real ports, in real time.", "weft-rig");
  Args args;
  app.add_option("RIG", args.rig, "rig file (JSON) with \"bench\": \"emulated\"")->required();
  app.add_option("--seed", args.seed, "set the seed of the sensor noise")->capture_default_str();
  app.add_option("--tcp", args.tcp_from,
                 "also serve every device on TCP, on 127.0.0.1 from this port on")
      ->check(CLI::Range(1, 65000));
  cli::add_generated_texts(app);
  if (const auto status = cli::parse_command_line(app, argc, argv)) return *status;
  if (const Status served = serve(args); !served) {
    std::cerr << "weft-rig: " << to_string(served.error()) << std::endl;
    return 1;
  }
  return 0;
}
