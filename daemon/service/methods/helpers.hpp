#pragma once
// Small things that all groups of methods use. For .cpp files of daemon/service/methods.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "daemon/service/methods/services.hpp"

namespace weft::daemon::api {

using access::Role;
using nlohmann::json;
using rpc::Call;
using rpc::format_text;
using rpc::Outcome;
using rpc::ParamType;
using rpc::refused;
using rpc::Responder;

/// Methods that work on one daemon's services. A handler is called with them and the call, and
/// returns an Outcome or, where the answer comes later, takes the Responder.
class MethodGroup {
 public:
  MethodGroup(rpc::Methods& methods, const Services& services)
      : methods_(&methods), services_(&services) {}

  /// One that changes nothing, for everybody.
  template <class Handler>
  rpc::MethodSpec& read(std::string_view name, std::string_view summary,
                        std::vector<rpc::ParamSpec> params, std::string_view result,
                        Handler handler) {
    return add({name, summary, Role::observer, rpc::Effect::read, std::move(params), result},
               handler);
  }
  template <class Handler>
  rpc::MethodSpec& change(std::string_view name, std::string_view summary, Role role,
                          std::vector<rpc::ParamSpec> params, std::string_view result,
                          Handler handler) {
    return add({name, summary, role, rpc::Effect::change, std::move(params), result}, handler);
  }

 private:
  template <class Handler>
  rpc::MethodSpec& add(rpc::MethodSpec spec, Handler handler) {
    if constexpr (std::is_invocable_v<Handler, const Services&, const Call&>)
      return methods_->add(std::move(spec), [s = services_, handler](const Call& call) -> Outcome {
        return handler(*s, call);
      });
    else
      return methods_->add(std::move(spec),
                           [s = services_, handler](const Call& call, const Responder& respond) {
                             handler(*s, call, respond);
                           });
  }

  rpc::Methods* methods_;
  const Services* services_;
};

/// The recipe's JSON Schema, built into the program from recipes/schema/recipe.schema.json.
std::string_view recipe_schema_json();

/// [{where, change: "added" | "removed" | "changed", was, is}], objects by key, lists by position;
/// `was` and `is` where there is such a thing. At most `most`; `all` counts them all.
/// Goes one call deeper at each level of the two: their depth is bounded by whoever read them.
json differences(const json& was, const json& is, std::size_t most, std::size_t& all);

/// A parameter that the method cannot use.
Error bad_param(std::string_view name, std::string what, std::string expected, std::string got);
/// The run as an answer, or why there is none.
Outcome run_outcome(const Result<runs::RunView>& run);
/// Answers with what `work` returns, which is done on another thread and uses nothing of the
/// server's: a halt waits for none of it. An internal error where it throws; request.too_many where
/// too much waits already.
void answer_in_background(const Services::BackgroundTask& background, const Responder& respond,
                          std::function<Outcome()> work);
/// check_quickly() of `request` on another thread, then `then` on the server's, which answers: with
/// the call as it was, so that what it needs, a lease, is looked at when it is used.
void check_in_background(const Services& services, const Call& call, const Responder& respond,
                         CampaignRequest request,
                         std::function<Outcome(const Call&, const runs::Checked&)> then);

/// Refuses a change to the rig while another user holds its lease.
tl::expected<void, rpc::RpcError> require_free_lease(const Services& services,
                                                     const rpc::Caller& caller);
/// Refuses to add a run to the queue without a lease, unless another user's is only kept for a run
/// under way: nothing begins before that run has ended.
tl::expected<void, rpc::RpcError> can_queue(const Services& services, const Call& call);
/// Refuses an order for the "run" parameter while another user's lease is kept for that run, or
/// another user holds the rig. With a "break_lease" parameter, a reason, that lease is broken
/// first, where the order would be taken; errors: access.role, for a role below `least_to_break`;
/// those of the journal.
tl::expected<void, rpc::RpcError> can_order(const Services& services, const Call& call,
                                            weft::daemon::Order order, Role least_to_break);
/// The refusal that names the holder.
tl::unexpected<rpc::RpcError> lease_held(const access::Lease& lease, const rpc::Caller& caller);
/// Refuses what may move the rig, or releases it, while a person has locked it out.
tl::expected<void, rpc::RpcError> require_unlocked(const Services& services);
/// The "lease" parameter is the caller's and of this rig.
tl::expected<void, rpc::RpcError> holds_lease(const Services& services, const Call& call);

/// Into the journal, with the caller or what else did it. Errors: io.
Status append_journal(const Services& services, std::string_view kind, std::string_view by,
                      const json& payload);

inline constexpr rpc::ParamSpec run_param{"run", ParamType::text, true, "its name, \"R-000318\""};
inline constexpr rpc::ParamSpec rig_lease_param{"lease", ParamType::text, true,
                                                "your lease of the rig"};
inline constexpr rpc::ParamSpec after_param{
    "after", ParamType::text, false,
    "a run, \"R-000317\": begin once that one has ended complete; \"\" for none"};
/// The "run" parameter.
std::string run_of(const Call& call);

inline constexpr std::int64_t unbounded = std::numeric_limits<std::int64_t>::max();
struct WholeNumber {
  const char* name;
  std::int64_t fallback, least, most;  ///< most: or unbounded
  const char* what;                    ///< of the error
};
/// A parameter that is a whole number from 0 on. Errors: range.
Result<std::size_t> read_whole_number(const Call& call, const WholeNumber& wanted);
/// One that may be left out. Errors: range, below zero.
Result<std::optional<std::uint64_t>> read_unsigned(const Call& call, const char* name,
                                                   const char* what);
/// The "seed" parameter.
inline Result<std::optional<std::uint64_t>> read_seed(const Call& call) {
  return read_unsigned(call, "seed", "negative seed");
}

inline constexpr rpc::ParamSpec parameters_param{
    "parameters", ParamType::object, false,
    "values of the recipe's parameters by name; defaults where left out"};
/// The "parameters" parameter as CampaignRequest takes it.
std::string read_parameters(const Call& call);

/// What run.start and queue.add take, for request_for_run(), with `more`.
std::vector<rpc::ParamSpec> run_request_params(const std::vector<rpc::ParamSpec>& more = {});

/// What run.start and queue.add ask for. Errors: recipe_file()'s, read_seed()'s.
Result<runs::RunRequest> request_for_run(const Services& services, const Call& call);

/// One answer's part of a list, bounded in bytes: a client reads it as one line.
class ListPage {
 public:
  static constexpr std::size_t most_bytes = std::size_t{1} << 20;
  explicit ListPage(std::size_t most) : most_(most) {}
  /// False where there is no room: it is the next page's first. The first one always has room.
  bool add(const json& item);
  enum class Order { as_added, reversed };
  /// A JSON array.
  [[nodiscard]] std::string text(Order order = Order::as_added) const;

 private:
  std::size_t most_, bytes_ = 0;
  std::vector<std::string> items_;
};

/// "from", "most" and "order" of a list of runs, for run.list and data.list.
const std::vector<rpc::ParamSpec>& page_params();
/// {`name`: [...], next: the run that the next page begins with, or null}: of the runs of
/// `filter`, in the order of the request, for which `callback` does not return null. Errors: range,
/// not_found.
Outcome runs_page(const Services& services, const Call& call, const char* name,
                  const std::function<json(const runs::RunView&)>& callback,
                  runs::RunFilter filter = {});

/// A run that nobody writes to: it has ended or was interrupted. Errors: not_found, wrong_state.
Result<runs::StoredRun> run_at_rest(const Services& services, const Call& call);

/// A recipe of the folder by its name, with or without ".json".
/// Errors: invalid_argument (not a plain name), not_found, with a did-you-mean.
Result<std::filesystem::path> recipe_file(const Services& services, const std::string& name);

}  // namespace weft::daemon::api
