// weft data: the folders listed by a running weftd.

#include <nlohmann/json.hpp>

#include "daemon/apps/weft/daemon_call.hpp"

namespace weft::daemon::cli {
namespace {

struct DataImportArgs : SocketArgs {
  std::filesystem::path folder;
};

void add_options(CLI::App& command, DataImportArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("FOLDER", args.folder, "campaign folder on the daemon's machine")->required();
}

/// A relative folder starts here, not in the daemon's working directory.
Result<int> run_data_import(client::Client& daemon, const DataImportArgs& args, Console& console) {
  const std::string folder = std::filesystem::absolute(args.folder).lexically_normal();
  return print_run(call(daemon, "data.import", {{"folder", folder}}), console);
}

}  // namespace

void add_data_commands(const CommandGroup& weft) {
  const CommandGroup data = weft.group("data");
  add_daemon_command(data, "import", run_data_import);
}

}  // namespace weft::daemon::cli
