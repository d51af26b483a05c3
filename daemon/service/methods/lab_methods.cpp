// The laboratory: its rigs, and the parts of campaigns that this rig takes.

#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

tl::unexpected<rpc::RpcError> without_lab() {
  return refused({.code = Errc::unsupported,
                  .where = "lab",
                  .what = "daemon has no laboratory store",
                  .hint = "Start weftd with --lab postgresql://USER@HOST/DATABASE"});
}

Outcome lab_status(const Services& services, const Call& /*call*/) {
  if (services.lab == nullptr) return without_lab();
  return format_text(services.lab->status_json());
}

Outcome lab_rigs(const Services& services, const Call& /*call*/) {
  if (services.lab == nullptr) return without_lab();
  return format_text(services.lab->rigs_json());
}

Outcome lab_accept(const Services& services, const Call& call) {
  if (services.lab == nullptr) return without_lab();
  if (auto open = require_unlocked(services); !open) return tl::unexpected(open.error());
  if (auto held = holds_lease(services, call); !held) return tl::unexpected(held.error());
  if (const Status done = services.lab->accept(call.params.at("lease").get<std::string>()); !done)
    return refused(done.error());
  return format_text(services.lab->status_json());
}

Outcome lab_withdraw(const Services& services, const Call& call) {
  if (services.lab == nullptr) return without_lab();
  services.lab->withdraw(rpc::by(call.caller));
  return format_text(services.lab->status_json());
}

constexpr const char* status_result =
    "rig, store, is_connected, error, reached_us, unpublished (runs that the store does not know "
    "yet), refused (publications that the store does not take), newest_refusal, accepted_by (user; "
    "null: no part is taken), part (campaign, number, fabric, attempt, "
    "run, is_lost; null: none)";

}  // namespace

void add_lab_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read("lab.status", "connection to the laboratory's store, and the part that this rig has",
             {}, status_result, lab_status);
  group.read("lab.rigs", "all rigs of the laboratory, as last read from the store", {},
             "rigs (rig, address, bench, state, seen_us, status), read_us (null: not read yet), "
             "now_us, is_connected, error",
             lab_rigs);
  group.change("lab.accept", "takes parts of campaigns until the caller's lease of the rig ends",
               Role::operator_, {rig_lease_param}, status_result, lab_accept);
  group.change("lab.withdraw", "takes no further part; a running one goes on", Role::operator_, {},
               status_result, lab_withdraw);
}

}  // namespace weft::daemon::api
