#include "daemon/apps/weft/own_daemon.hpp"

#include <optional>
#include <ostream>
#include <vector>

#include "daemon/base/loop/caught.hpp"
#include "daemon/service/daemon/weftd.hpp"

namespace weft::daemon::cli {
namespace {

/// Folders that were made for the socket alone go with it.
class FoldersForSocket {
 public:
  explicit FoldersForSocket(const std::filesystem::path& folder) {
    std::error_code error;
    for (auto missing = std::filesystem::absolute(folder);
         missing.has_relative_path() && !std::filesystem::exists(missing, error);
         missing = missing.parent_path())
      missing_.push_back(missing);
  }
  ~FoldersForSocket() {
    std::error_code error;  // one that is not empty stays, and those above it
    for (const auto& folder : missing_) std::filesystem::remove(folder, error);
  }
  FoldersForSocket(const FoldersForSocket&) = delete;
  FoldersForSocket& operator=(const FoldersForSocket&) = delete;

 private:
  std::vector<std::filesystem::path> missing_;  // the innermost first
};

}  // namespace

Result<CampaignSummary> run_with_daemon(const RunArgs& args, const CampaignRequest& request,
                                        const Campaign& campaign, Console& console) {
  const FoldersForSocket folders(request.out);
  const auto socket = args.socket.empty() ? request.out / "weftd.sock" : args.socket;
  std::optional<Result<CampaignSummary>> ran;
  server::OwnRun own;
  own.request.recipe = request.recipe;
  own.request.seed = request.seed;
  own.request.by = "weft run";
  own.request.folder = std::filesystem::absolute(request.out);
  own.check = [&request] { return check_quickly(request); };
  own.perform = [&](const CampaignHooks& hooks) -> Result<CampaignSummary> {
    if (console.terminal)
      console.err << "weft: from elsewhere: weft watch, pause, stop, halt ... --socket "
                  << socket.string() << std::endl;
    ran = caught([&] { return campaign(hooks); });
    return *ran;
  };
  server::DaemonOptions options;
  options.rig = request.rig;
  options.recipes = std::filesystem::absolute(request.recipe).parent_path();
  options.data = request.out;
  options.socket = socket;
  const Status served = caught([&] { return server::run_daemon_for(options, own); }, "daemon");
  if (ran) return std::move(*ran);
  CampaignHooks alone;
  alone.rig_taken = [&] {
    if (!served)
      console.err << "weft: nobody else can look at this run or stop it: "
                  << to_string(served.error()) << std::endl;
    return Status{};
  };
  return campaign(alone);
}

}  // namespace weft::daemon::cli
