#pragma once
// Small things that all groups of methods use. For .cpp files of daemon/service/methods.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/methods/services.hpp"

namespace weft::daemon::api {

/// The recipe's JSON Schema, built into the program from recipes/schema/recipe.schema.json.
std::string_view recipe_schema_json();

/// [{where, change: "added" | "removed" | "changed", was, is}], objects by key, lists by position;
/// `was` and `is` where there is such a thing. At most `most`; `all` counts them all.
/// Goes one call deeper at each level of the two: their depth is bounded by whoever read them.
nlohmann::json differences(const nlohmann::json& was, const nlohmann::json& is, std::size_t most,
                           std::size_t& all);

/// JSON on one line; text that is not UTF-8 is replaced.
std::string format_text(const nlohmann::json& value);
tl::unexpected<rpc::RpcError> refused(const Error& error);
/// Answers with what `work` returns, which is done on another thread and uses nothing of the
/// server's: a halt waits for none of it. An internal error where it throws; request.too_many where
/// too much waits already.
void answer_in_background(const Services::BackgroundTask& background, const rpc::Responder& respond,
                          std::function<rpc::Outcome()> work);
/// check_quickly() of `request` on another thread, then `then` on the server's, which answers: with
/// the call as it was, so that what it needs, a lease, is looked at when it is used.
void check_in_background(const Services& services, const rpc::Call& call,
                         const rpc::Responder& respond, CampaignRequest request,
                         std::function<rpc::Outcome(const rpc::Call&, const runs::Checked&)> then);

/// Refuses a change to the rig while another user holds its lease.
tl::expected<void, rpc::RpcError> require_free_lease(const Services& services,
                                                     const rpc::Caller& caller);
/// The "lease" parameter is the caller's and of this rig.
tl::expected<void, rpc::RpcError> holds_lease(const Services& services, const rpc::Call& call);

/// The "run" parameter.
std::string run_of(const rpc::Call& call);
/// The "seed" parameter, where there is one. Errors: range, below zero.
Result<std::optional<std::uint64_t>> read_seed(const rpc::Call& call);

/// What run.start and queue.add ask for. Errors: recipe_file()'s, read_seed()'s.
Result<runs::RunRequest> request_for_run(const Services& services, const rpc::Call& call);

/// One answer's part of a list, bounded in bytes: a client reads it as one line.
class ListPage {
 public:
  static constexpr std::size_t most_bytes = std::size_t{1} << 20;
  explicit ListPage(std::size_t most) : most_(most) {}
  /// False where there is no room: it is the next page's first. The first one always has room.
  bool add(const nlohmann::json& item);
  enum class Order { as_added, reversed };
  /// A JSON array.
  [[nodiscard]] std::string text(Order order = Order::as_added) const;

 private:
  std::size_t most_, bytes_ = 0;
  std::vector<std::string> items_;
};

/// "from" and "most" of a list of runs, for run.list and data.list.
const std::vector<rpc::ParamSpec>& page_params();
/// {`name`: [...], next: the run that the next page begins with, or null}: of the runs that
/// `callback` has something to say of, null where it has not. Errors: range, not_found.
rpc::Outcome runs_page(const Services& services, const rpc::Call& call, const char* name,
                       const std::function<nlohmann::json(const runs::RunView&)>& callback);

/// A recipe of the folder by its name, with or without ".json".
/// Errors: invalid_argument (not a plain name), not_found, with a did-you-mean.
Result<std::filesystem::path> recipe_file(const Services& services, const std::string& name);

}  // namespace weft::daemon::api
