#pragma once
// Helpers shared by all groups of methods. For .cpp files of daemon/service/methods.

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

/// Registers methods that use one daemon's services. A handler gets the services and the call. It
/// returns an Outcome or, if it answers later, takes the Responder.
class MethodGroup {
 public:
  MethodGroup(rpc::Methods& methods, const Services& services)
      : methods_(&methods), services_(&services) {}

  /// Adds a method that changes nothing; every role may call it.
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

/// The recipe's JSON Schema, compiled in from recipes/schema/recipe.schema.json.
std::string_view recipe_schema_json();

/// [{where, change: "added" | "removed" | "changed", was, is}]; compares objects by key, lists by
/// position. `was` and `is` are present if there is such a value. At most `most` entries; `all`
/// counts every difference. Recursive: the caller must bound the depth of both values.
json differences(const json& was, const json& is, std::size_t most, std::size_t& all);

/// Error about a parameter that the method cannot use.
Error bad_param(std::string_view name, std::string what, std::string expected, std::string got);
/// The run as an answer, or the error.
Outcome run_outcome(const Result<runs::RunView>& run);
/// Answers with the result of `work`, which runs on another thread and uses nothing of the server's
/// thread, so that it delays no halt. Errors: internal, if it throws; request.too_many, if too much
/// work is waiting.
void answer_in_background(const Services::BackgroundTask& background, const Responder& respond,
                          std::function<Outcome()> work);
/// Calls check_quickly() for `request` on another thread, then `then` on the server's thread, which
/// answers. `then` gets the original call, so that conditions such as a lease are checked when they
/// are used.
void check_in_background(const Services& services, const Call& call, const Responder& respond,
                         CampaignRequest request,
                         std::function<Outcome(const Call&, const runs::Checked&)> then);

/// Refuses a change to the rig while another user holds its lease.
tl::expected<void, rpc::RpcError> require_free_lease(const Services& services,
                                                     const rpc::Caller& caller);
/// Refuses to queue a run without a lease. Exception: another user's lease that is only kept for
/// the active run, because nothing starts before that run has ended.
tl::expected<void, rpc::RpcError> can_queue(const Services& services, const Call& call);
/// Refuses an order for the "run" parameter while another user has the lease of the rig. The same
/// holds while another user's lease is kept for that run. With a "break_lease" parameter (the
/// reason), breaks that lease first, if the order itself is acceptable. Errors: access.role, for a
/// role below `least_to_break`; those of the journal.
tl::expected<void, rpc::RpcError> can_order(const Services& services, const Call& call,
                                            weft::daemon::Order order, Role least_to_break);
/// The refusal that names the lease's holder.
tl::unexpected<rpc::RpcError> lease_held(const access::Lease& lease, const rpc::Caller& caller);
/// Refuses what may move or release the rig while it is locked out.
tl::expected<void, rpc::RpcError> require_unlocked(const Services& services);
/// Checks that the "lease" parameter is the caller's lease of this rig.
tl::expected<void, rpc::RpcError> holds_lease(const Services& services, const Call& call);

/// Appends to the journal; `by` is the caller or another cause. Errors: io.
Status append_journal(const Services& services, std::string_view kind, std::string_view by,
                      const json& payload);

inline constexpr rpc::ParamSpec run_param{"run", ParamType::text, true,
                                          "id of the run, \"R-000318\""};
inline constexpr rpc::ParamSpec rig_lease_param{"lease", ParamType::text, true,
                                                "your lease of the rig"};
inline constexpr rpc::ParamSpec after_param{
    "after", ParamType::text, false,
    "start only after this run, \"R-000317\", is complete (\"\": none)"};
/// Value of the "run" parameter.
std::string run_of(const Call& call);

inline constexpr std::int64_t unbounded = std::numeric_limits<std::int64_t>::max();
struct WholeNumber {
  const char* name;
  std::int64_t fallback, least, most;  ///< `most` may be `unbounded`
  const char* what;                    ///< what the error reports as failed
};
/// Reads a parameter that is a whole number from 0 upwards. Errors: range.
Result<std::size_t> read_whole_number(const Call& call, const WholeNumber& wanted);
/// Reads an optional parameter. Errors: range, if it is negative.
Result<std::optional<std::uint64_t>> read_unsigned(const Call& call, const char* name,
                                                   const char* what);
/// Value of the "seed" parameter.
inline Result<std::optional<std::uint64_t>> read_seed(const Call& call) {
  return read_unsigned(call, "seed", "negative seed");
}

inline constexpr rpc::ParamSpec parameters_param{
    "parameters", ParamType::object, false,
    "values of the recipe's parameters by name; the others keep their defaults"};
/// Value of the "parameters" parameter, as in CampaignRequest.
std::string read_parameters(const Call& call);

/// Parameters of run.start and queue.add, for request_for_run(), followed by `more`.
std::vector<rpc::ParamSpec> run_request_params(const std::vector<rpc::ParamSpec>& more = {});

/// The request of a run.start or queue.add call. Errors: those of recipe_file() and read_seed().
Result<runs::RunRequest> request_for_run(const Services& services, const Call& call);

/// One page of a list, bounded in bytes because a client reads an answer as one line.
class ListPage {
 public:
  static constexpr std::size_t most_bytes = std::size_t{1} << 20;
  explicit ListPage(std::size_t most) : most_(most) {}
  /// False if the item does not fit; it then starts the next page. The first item always fits.
  bool add(const json& item);
  enum class Order { as_added, reversed };
  /// The page as a JSON array.
  [[nodiscard]] std::string text(Order order = Order::as_added) const;

 private:
  std::size_t most_, bytes_ = 0;
  std::vector<std::string> items_;
};

/// "from", "most" and "order" of a list of runs, for run.list and data.list.
const std::vector<rpc::ParamSpec>& page_params();
/// {`name`: [...], next: first run of the next page, or null}. Lists the runs that match `filter`,
/// in the requested order, without those for which `callback` returns null. Errors: range,
/// not_found.
Outcome runs_page(const Services& services, const Call& call, const char* name,
                  const std::function<json(const runs::RunView&)>& callback,
                  runs::RunFilter filter = {});

/// The run of the call, if it has ended or was interrupted, so that its folder is not being
/// written. Errors: not_found, wrong_state.
Result<runs::StoredRun> run_at_rest(const Services& services, const Call& call);

/// File of a recipe in the recipe folder, by name with or without ".json". Errors: invalid_argument
/// (not a plain name), not_found, with a suggestion.
Result<std::filesystem::path> recipe_file(const Services& services, const std::string& name);

}  // namespace weft::daemon::api
