#include "daemon/cli/own_daemon.hpp"

#include <ostream>

#include "daemon/control/caught.hpp"
#include "daemon/server/weftd.hpp"

namespace weft::daemon::cli {
namespace {

/// A folder that was made for the socket alone goes with it.
class FolderForSocket {
 public:
  explicit FolderForSocket(const std::filesystem::path& folder) : folder_(folder) {
    std::error_code error;
    was_there_ = std::filesystem::exists(folder_, error);
  }
  ~FolderForSocket() {
    std::error_code error;
    if (!was_there_ && std::filesystem::is_empty(folder_, error))
      std::filesystem::remove(folder_, error);
  }
  FolderForSocket(const FolderForSocket&) = delete;
  FolderForSocket& operator=(const FolderForSocket&) = delete;

 private:
  std::filesystem::path folder_;
  bool was_there_ = false;
};

}  // namespace

Result<CampaignSummary> run_with_daemon(const RunArgs& args, const CampaignRequest& request,
                                        const Campaign& campaign, Console& console) {
  const FolderForSocket folder(request.out);
  const auto socket = args.socket.empty() ? request.out / "weftd.sock" : args.socket;
  std::optional<Result<CampaignSummary>> ran;
  server::OwnRun own;
  own.wish.recipe = request.recipe;
  own.wish.seed = request.seed;
  own.wish.by = "weft run";
  own.wish.folder = std::filesystem::absolute(request.out);
  own.perform = [&](const CampaignHooks& hooks) -> Result<CampaignSummary> {
    if (console.terminal)
      console.err << "weft: from elsewhere: weft watch, pause, stop, halt ... --socket "
                  << socket.string() << std::endl;
    ran = control::caught([&] { return campaign(hooks); });
    Result<CampaignSummary> told = *ran;
    if (told) told->wants_hand_over = false;  // `weft run` does that itself
    return told;
  };
  server::DaemonOptions options;
  options.rig = request.rig;
  options.recipes = std::filesystem::absolute(request.recipe).parent_path();
  options.data = request.out;
  options.socket = socket;
  const Status served = server::run_daemon_for(options, own, check_quickly(request));
  if (ran) return std::move(*ran);
  if (!served)
    console.err << "weft: nobody else can look at this run or stop it: "
                << to_string(served.error()) << std::endl;
  return campaign({});
}

}  // namespace weft::daemon::cli
