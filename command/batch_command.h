#pragma once

#include <cstdint>
#include <string>

#include "lab/batch/job_files.h"

namespace CLI {
class App;
}

namespace carom::command {

/// `carom batch`: plans, makes and verifies batches of samples.
class BatchCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit BatchCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code: 1 if a sample fails, or a file is missing or damaged.
  int run() const;

 private:
  CLI::App* add(const char* name, const char* description);
  void addPlan();
  void addRun();
  void addVerify();
  void addRepeat();
  void addReport();
  void addPack();
  void addSchedulers();
  int plan() const;
  int runAll() const;
  int verify() const;
  int repeat() const;
  int report() const;
  int pack() const;
  int slurm() const;
  int writeJobs(const char* file, std::string (*text)(const lab::JobSet&)) const;

  CLI::App* command_;
  CLI::App* plan_ = nullptr;
  CLI::App* run_ = nullptr;
  CLI::App* verify_ = nullptr;
  CLI::App* repeat_ = nullptr;
  CLI::App* report_ = nullptr;
  CLI::App* pack_ = nullptr;
  CLI::App* slurm_ = nullptr;
  CLI::App* parallel_ = nullptr;
  CLI::App* snakemake_ = nullptr;
  std::string input_;   // batch file, or the folder of a plan
  std::string output_;  // folder, or a sound file
  std::string shard_;   // "I/N"; empty: all
  std::string branch_;
  double count_ = 0.0;  // 0: the batch's own
  double index_ = 0.0;
  double processes_ = 0.0;   // 0: one for each processor
  double shards_ = 0.0;      // 0: as many as take a minute each
  double samples_ = 1000.0;  // in a tar file
  bool dryRun_ = false;
  bool retry_ = false;
  bool thorough_ = false;
  bool json_ = false;
};

}  // namespace carom::command
