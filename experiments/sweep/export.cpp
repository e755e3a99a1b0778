#include "experiments/sweep/export.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <set>

#include "autograd/base/error.h"
#include "autograd/base/nearest.h"
#include "experiments/text.h"

namespace restage::tables {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMaxTasks = 1000;  ///< Slurm's MaxArraySize is 1001 unless somebody raised it

void refuse(const std::string& path, const std::string& characters, const std::string& what) {
  if (path.find_first_of(characters) == std::string::npos) return;
  throw InputError("", "the path '" + path + "' has " + what + ", which the engine cannot be told",
                   "rename the folder, or give another one");
}

/// A name that may stand in a line of options.
std::string job_name(const std::string& dir) {
  std::string name = std::filesystem::path(dir).filename().string();
  std::erase_if(name, [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '_'; });
  return "restage" + (name.empty() ? "" : "-" + name);
}

// ---- Slurm -------------------------------------------------------------------------------------

/// Memory, and the time of so many trials one after the other.
std::string slurm_limits(const ExportOptions& o, size_t trials) {
  std::string out;
  if (o.megabytes > 0) out += "#SBATCH --mem=" + std::to_string(o.megabytes) + "M\n";
  if (o.minutes <= 0) return out;
  const int64_t minutes = o.minutes * static_cast<int64_t>(trials);
  char text[48];
  std::snprintf(text, sizeof text, "#SBATCH --time=%lld:%02lld:00\n",
                static_cast<long long>(minutes / 60), static_cast<long long>(minutes % 60));
  return out + text;
}

std::string slurm_script(const std::vector<sweep::TrialEntry>& plan, const ExportOptions& o) {
  std::string ids;
  for (const sweep::TrialEntry& trial : plan) ids += "  " + trial.id + "\n";
  const size_t tasks = std::min(plan.size(), kMaxTasks);
  return "#!/bin/bash\n"
         "# The trials of a sweep: sbatch FILE (options given to sbatch win over those below).\n"
         "# A requeued or repeated job goes on where its trial was left; done ones are passed by.\n"
         "#SBATCH --job-name=" +
         job_name(o.dir) +
         "\n"
         "#SBATCH --array=0-" +
         std::to_string(tasks - 1) +
         "\n"
         "#SBATCH --requeue\n"
         "#SBATCH --open-mode=append\n"
         "#SBATCH --signal=B:USR1@120\n"
         "#SBATCH --cpus-per-task=" +
         std::to_string(o.threads) + "\n" + slurm_limits(o, (plan.size() + tasks - 1) / tasks) +
         "restage=" + shell_word(o.program) +
         "\n"
         "dir=" +
         shell_word(o.dir) +
         "\n"
         "ids=(\n" +
         ids +
         ")\n"
         "tasks=" +
         std::to_string(tasks) +
         "\n"
         R"(code=0 stopping= again= trial=
# What Slurm tells this shell the trial must hear of, to write a checkpoint. USR1: the time is nearly up.
trap 'stopping=1; [ -z "$trial" ] || kill -TERM "$trial" 2> /dev/null' TERM
trap 'stopping=1 again=1; [ -z "$trial" ] || kill -TERM "$trial" 2> /dev/null' USR1
for ((i = SLURM_ARRAY_TASK_ID; i < ${#ids[@]}; i += tasks)); do
  "$restage" trial "$dir" "${ids[i]}" --threads "${SLURM_CPUS_PER_TASK:-1}" &
  trial=$!
  # Told before the trial's number was known: it has not been passed on yet.
  [ -z "$stopping" ] || kill -TERM "$trial" 2> /dev/null
  # Not `wait` alone: told in the moment before it blocks, this shell would hear of it when the trial has ended.
  while kill -0 "$trial" 2> /dev/null; do sleep 0.5; done
  wait "$trial"
  ended=$?
  # A trial that needed more time than was given goes on in the next job of this task.
  [ -z "$again" ] || [ "$ended" = 0 ] || scontrol requeue "$SLURM_JOB_ID"
  [ -z "$stopping" ] || exit "$ended"
  trial=
  [ "$ended" = 0 ] || code=$ended
done
exit "$code"
)";
}

// ---- GNU parallel ------------------------------------------------------------------------------

std::string parallel_list(const std::vector<sweep::TrialEntry>& plan, const ExportOptions& o) {
  std::string text;
  for (const sweep::TrialEntry& trial : plan)
    text += shell_word(o.program) + " trial " + shell_word(o.dir) + " " + trial.id + " --threads " +
            std::to_string(o.threads) + "\n";
  return text;
}

// ---- Snakemake ---------------------------------------------------------------------------------

/// An artifact that several trials use.
struct Shared {
  std::string name, stage;
  std::vector<const sweep::TrialEntry*> users;
  std::set<std::string> after;  ///< shared artifacts that all of its users have as well
};

bool uses(const sweep::TrialEntry& trial, const std::string& name) {
  return std::any_of(trial.artifacts.begin(), trial.artifacts.end(),
                     [&](const auto& a) { return a.first + "-" + a.second == name; });
}

/// A plan does not say which artifact reads which. One that stands earlier in every trial that uses
/// the later one may be read by it, and is made before it.
std::vector<Shared> shared_artifacts(const std::vector<sweep::TrialEntry>& plan) {
  std::vector<Shared> out;
  for (const sweep::TrialEntry& trial : plan)
    for (const auto& [stage, id] : trial.artifacts) {
      const std::string name = stage + "-" + id;
      auto at =
          std::find_if(out.begin(), out.end(), [&](const Shared& s) { return s.name == name; });
      if (at == out.end()) at = out.insert(at, {name, stage, {}, {}});
      at->users.push_back(&trial);
    }
  std::erase_if(out, [](const Shared& s) { return s.users.size() < 2; });
  for (Shared& later : out)
    for (const auto& [stage, id] : later.users.front()->artifacts) {
      if (stage == later.stage) break;
      const std::string name = stage + "-" + id;
      if (std::all_of(later.users.begin(), later.users.end(),
                      [&](const sweep::TrialEntry* t) { return uses(*t, name); }))
        later.after.insert(name);
    }
  return out;
}

/// JSON text of strings, lists and maps is Python's too; characters stay as they are.
std::string python(const Json& value) { return value.dump(2); }

std::string snakefile(const std::vector<sweep::TrialEntry>& plan, const ExportOptions& o) {
  const std::vector<Shared> shared = shared_artifacts(plan);
  Json trials = Json::object(), stages = Json::object(), resources = Json::object();
  if (o.megabytes > 0) resources["mem_mb"] = o.megabytes;
  if (o.minutes > 0) resources["runtime"] = o.minutes;
  for (const sweep::TrialEntry& trial : plan) {
    Json& needs = trials[trial.id] = Json::array();
    for (const Shared& s : shared)
      if (uses(trial, s.name)) needs.push_back(s.name);
  }
  for (const Shared& s : shared)
    stages[s.name] = {{"trial", s.users.front()->id}, {"stage", s.stage}, {"after", s.after}};
  return R"(# The trials of a sweep and the stages that several of them share: snakemake -s FILE --cores N
# (and -k, so that one failed trial does not keep others from starting).
import json
import os

RESTAGE = )" +
         python(o.program) + R"(
DIR = )" +
         python(o.dir) + R"(
THREADS = )" +
         std::to_string(o.threads) + R"(
RESOURCES = )" +
         python(resources) + R"(
# Each trial with the shared artifacts that it needs; each of these with a trial that it is part of.
TRIALS = )" +
         python(trials) + R"(
STAGES = )" +
         python(stages) + R"(
MARKS = os.path.join(DIR, "snakemake")


def state(trial):
    """What its own result says; nothing else decides whether a trial is done."""
    try:
        with open(os.path.join(DIR, "trials", trial, "result.json")) as f:
            return json.load(f)["state"]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def mark(name):
    return os.path.join(MARKS, name)


# Snakemake wants files of its own, which it may delete: marks, never results or artifacts.
for trial in TRIALS:
    if state(trial) not in ("done", "stopped") and os.path.exists(mark(trial + ".trial")):
        os.remove(mark(trial + ".trial"))


rule all:
    input: [mark(trial + ".trial") for trial in TRIALS if state(trial) != "done"]


rule stage:
    input: lambda wildcards: [mark(name + ".stage") for name in STAGES[wildcards.name]["after"]]
    output: temp(mark("{name}.stage"))
    wildcard_constraints: name="[^/]+"
    params: trial=lambda wildcards: STAGES[wildcards.name]["trial"], stage=lambda wildcards: STAGES[wildcards.name]["stage"]
    threads: THREADS
    resources: **RESOURCES
    shell: "{RESTAGE:q} trial {DIR:q} {params.trial} --stage {params.stage:q} --threads {threads} && touch {output:q}"


rule trial:
    input: lambda wildcards: [mark(name + ".stage") for name in TRIALS[wildcards.trial]]
    output: mark("{trial}.trial")
    wildcard_constraints: trial="[0-9a-f]+"
    threads: THREADS
    resources: **RESOURCES
    shell: "{RESTAGE:q} trial {DIR:q} {wildcards.trial} --threads {threads} && touch {output:q}"
)";
}

}  // namespace

Engine engine_named(const std::string& name) {
  const std::vector<std::string> names = {"slurm", "parallel", "snakemake"};
  const auto at = std::find(names.begin(), names.end(), name);
  if (at != names.end()) return static_cast<Engine>(at - names.begin());
  const std::string near = nearest(name, names);
  throw InputError(
      "", "there is no engine '" + name + "'",
      near.empty() ? "there are slurm, parallel and snakemake" : "did you mean '" + near + "'?");
}

std::string export_script(Engine engine, const std::vector<sweep::TrialEntry>& plan,
                          const ExportOptions& options) {
  for (const std::string& path : {options.program, options.dir}) {
    refuse(path, "\r\n", "a line break");
    if (engine == Engine::snakemake) refuse(path, "{}", "a brace");
  }
  if (plan.empty())
    throw InputError(options.dir, "the plan has no trials", "plan the sweep again with --out");
  switch (engine) {
    case Engine::slurm:
      return slurm_script(plan, options);
    case Engine::parallel:
      return parallel_list(plan, options);
    case Engine::snakemake:
      break;
  }
  return snakefile(plan, options);
}

}  // namespace restage::tables
