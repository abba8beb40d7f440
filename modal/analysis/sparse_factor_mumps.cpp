#include <cassert>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <dlfcn.h>
#include <dmumps_c.h>

#include "audio/model/mutex.h"
#include "modal/analysis/sparse_factor.h"

namespace carom::modal {
namespace {

constexpr MUMPS_INT kWorldCommunicator = -987654;  // MUMPS's number for all processes: one
// Approximate minimum degree: it always gives the same result, and is sound on any graph. Scotch
// needs half of the operations, but goes on in one sequence of random numbers from call to call, so
// that the second result differs from the first; PORD ends the process on some graphs; Debian's
// build has no METIS.
constexpr MUMPS_INT kMinimumDegree = 0;
constexpr MUMPS_INT kGivenOrder = 1;
constexpr MUMPS_INT kSingular = -10;
constexpr MUMPS_INT kWorkspaceTooSmall = -9;
constexpr int kAttempts = 4;

enum Job : MUMPS_INT { kStart = -1, kEnd = -2, kAnalyse = 1, kFactorise = 2, kSolve = 3 };

// MUMPS keeps state of its own outside of the instance, so its calls are serialised.
audio::Mutex& libraryMutex() {
  static audio::Mutex mutex;
  return mutex;
}

// Finds a function of a library that MUMPS brings along, which may be another one elsewhere; null
// if it is not there.
template <class Function>
Function* loaded(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
}

// Holds OpenBLAS to one thread, as sums depend on how many threads share them. Other libraries of
// BLAS are left as they are.
class OneBlasThread {
 public:
  OneBlasThread() {
    if (get_ != nullptr && set_ != nullptr) {
      before_ = get_();
      set_(1);
    }
  }
  ~OneBlasThread() {
    if (before_ > 1) set_(before_);
  }
  OneBlasThread(const OneBlasThread&) = delete;
  OneBlasThread& operator=(const OneBlasThread&) = delete;

 private:
  int (*get_)() = loaded<int()>("openblas_get_num_threads");
  void (*set_)(int) = loaded<void(int)>("openblas_set_num_threads");
  int before_ = 0;
};

}  // namespace

struct SparseFactor::Implementation {
  DMUMPS_STRUC_C instance{};
  std::vector<MUMPS_INT> rows;
  std::vector<MUMPS_INT> columns;
  std::vector<double> values;
  std::vector<MUMPS_INT> positions;  // of the rows in the order of elimination

  explicit Implementation(Definiteness definiteness) {
    instance.par = 1;
    instance.sym = definiteness == Definiteness::kPositive ? 1 : 2;
    instance.comm_fortran = kWorldCommunicator;
    run(kStart);
    for (int stream = 1; stream <= 3; ++stream)
      control(stream) = -1;  // no output
    control(4) = 0;
    control(7) = kMinimumDegree;
    control(14) = 50;  // per cent of memory beyond the estimate
    control(16) = 1;   // threads
  }
  ~Implementation() { run(kEnd); }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  // Controls and results have the numbers of MUMPS's manual, from 1.
  MUMPS_INT& control(int number) { return instance.icntl[number - 1]; }
  MUMPS_INT info(int number) const { return instance.infog[number - 1]; }

  void run(Job job) {
    const audio::MutexLock lock(libraryMutex());
    const OneBlasThread oneThread;
    instance.job = job;
    dmumps_c(&instance);
  }

  // Copies one half of the matrix, which is what MUMPS expects.
  void take(const SparseMatrix& matrix) {
    for (Eigen::Index outer = 0; outer < matrix.outerSize(); ++outer) {
      for (SparseMatrix::InnerIterator entry(matrix, outer); entry; ++entry) {
        if (entry.row() < entry.col()) continue;
        rows.push_back(static_cast<MUMPS_INT>(entry.row() + 1));
        columns.push_back(static_cast<MUMPS_INT>(entry.col() + 1));
        values.push_back(entry.value());
      }
    }
    instance.n = static_cast<MUMPS_INT>(matrix.rows());
    instance.nnz = static_cast<MUMPS_INT8>(values.size());
    instance.irn = rows.data();
    instance.jcn = columns.data();
    instance.a = values.data();
  }

  // Analyses the matrix for the given order as well, and takes the one with fewer operations.
  void analyse(std::span<const int> order) {
    run(kAnalyse);
    if (order.empty() || info(1) < 0) return;
    assert(std::ssize(order) == instance.n);
    positions.resize(order.size());
    for (std::size_t position = 0; position < order.size(); ++position)
      positions[static_cast<std::size_t>(order[position])] = static_cast<MUMPS_INT>(position + 1);
    const double operations = instance.rinfog[0];
    control(7) = kGivenOrder;
    instance.perm_in = positions.data();
    run(kAnalyse);
    if (info(1) >= 0 && instance.rinfog[0] <= operations) return;
    control(7) = kMinimumDegree;
    run(kAnalyse);
  }

  void factorise(std::span<const int> order) {
    analyse(order);
    for (int attempt = 0; attempt < kAttempts && info(1) >= 0; ++attempt) {
      run(kFactorise);
      if (info(1) != kWorkspaceTooSmall) return;
      control(14) *= 3;
      instance.infog[0] = 0;
    }
  }
};

SparseFactor::SparseFactor(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
SparseFactor::SparseFactor(SparseFactor&&) noexcept = default;
SparseFactor& SparseFactor::operator=(SparseFactor&&) noexcept = default;
SparseFactor::~SparseFactor() = default;

Result<SparseFactor> SparseFactor::of(const SparseMatrix& matrix, Definiteness definiteness,
                                      std::span<const int> order) {
  auto implementation = std::make_unique<Implementation>(definiteness);
  implementation->take(matrix);
  implementation->factorise(order);
  const MUMPS_INT outcome = implementation->info(1);
  if (outcome == kSingular) return Error{"the matrix is singular"};
  if (outcome < 0)
    return Error{
        "the factorisation of a matrix of " + std::to_string(matrix.rows()) +
        " rows failed (MUMPS's error " + std::to_string(outcome) +
        "; -13 and -9 mean that memory does not suffice): ask for fewer degrees of freedom"};
  return SparseFactor(std::move(implementation));
}

void SparseFactor::solve(Eigen::MatrixXd& block) const {
  if (block.size() == 0) return;
  DMUMPS_STRUC_C& instance = implementation_->instance;
  instance.nrhs = static_cast<MUMPS_INT>(block.cols());
  instance.lrhs = static_cast<MUMPS_INT>(block.rows());
  instance.rhs = block.data();
  implementation_->run(kSolve);
}

Eigen::Index SparseFactor::negative() const {
  return implementation_->info(12);
}

}  // namespace carom::modal
