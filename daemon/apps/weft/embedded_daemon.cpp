#include "daemon/apps/weft/embedded_daemon.hpp"

#include <optional>
#include <ostream>
#include <vector>

#include "daemon/base/loop/catch_as_error.hpp"
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
  server::EmbeddedRun embedded;
  embedded.request.recipe = request.recipe;
  embedded.request.seed = request.seed;
  embedded.request.by = "weft run";
  embedded.request.folder = std::filesystem::absolute(request.out);
  embedded.check = [&request] { return check_quickly(request); };
  embedded.perform = [&](const CampaignHooks& hooks) -> Result<CampaignSummary> {
    if (console.terminal)
      console.err << "weft: from elsewhere: weft watch, pause, stop, halt ... --socket "
                  << socket.string() << std::endl;
    ran = catch_as_error([&] { return campaign(hooks); });
    return *ran;
  };
  server::DaemonOptions options;
  options.rig = request.rig;
  options.recipes = std::filesystem::absolute(request.recipe).parent_path();
  options.data = request.out;
  options.socket = socket;
  const Status served =
      catch_as_error([&] { return server::run_daemon_for(options, embedded); }, "daemon");
  if (ran) return std::move(*ran);
  CampaignHooks alone;
  alone.rig_acquired = [&] {
    if (!served)
      console.err << "weft: nobody else can look at this run or stop it: "
                  << to_string(served.error()) << std::endl;
    return Status{};
  };
  return campaign(alone);
}

}  // namespace weft::daemon::cli
