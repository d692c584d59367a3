//! What can end a run, and how the process then exits.

use crate::curvature::InstructionSet;
use crate::demo::DemoError;
use crate::forecast::ForecastError;
use crate::index::IndexError;
use crate::open::OpenError;
use crate::passes::TileError;
use crate::pipeline::{Interrupted, LostJob, Stopped};
use crate::resume::ResumeError;
use crate::settings::SettingsError;
use crate::statistics::RasterError;
use crate::stitch::RecordError;
use crate::store::StoreError;
use crate::triangulate::DrapeError;
use crate::validate::ValidateError;
use crate::weld::WeldError;
use crate::write::WriteError;

/// Why a run ended without a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The settings cannot be used.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// An input cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The cloud has no surface.
    #[error(transparent)]
    Drape(#[from] DrapeError),
    /// The files are not one surface.
    #[error(transparent)]
    Weld(#[from] WeldError),
    /// The survey cannot be indexed.
    #[error(transparent)]
    Index(#[from] IndexError),
    /// The work folder cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The raster cannot be made.
    #[error(transparent)]
    Raster(#[from] RasterError),
    /// A result cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The sample scene cannot be written.
    #[error(transparent)]
    Demo(#[from] DemoError),
    /// The run cannot be held against known stones.
    #[error(transparent)]
    Validate(Box<ValidateError>),
    /// Somebody pressed Ctrl-C.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// A tile of a pass on which all others depend panicked.
    #[error("part {} of the {pass} pass failed: {}\nhelp: what was done is kept; the same command with --resume tries that part again", lost.job, lost.message)]
    TileFailed {
        /// The pass.
        pass: &'static str,
        /// The tile and what it said.
        lost: LostJob,
    },
    /// The published stencil is as wide as vertices lie from their triangles, which here is nothing.
    #[error(
        "every vertex has a face that names it three times, so that the nearest centre of a triangle is 0 m away and curvature has no scale\nhelp: remove the faces without area, for instance in MeshLab with Filters > Cleaning and Repairing"
    )]
    NoSpacing,
    /// An interrupted run cannot be resumed.
    #[error(transparent)]
    Resume(#[from] ResumeError),
    /// What a tile found cannot be recorded or read again.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The run needs more than there is.
    #[error(transparent)]
    Forecast(#[from] ForecastError),
    /// A look at part of the survey failed.
    #[error(transparent)]
    Tile(#[from] TileError),
    /// The processor lacks what was asked for.
    #[error("work.instructions: this processor has no {wanted:?}; it has {available:?}\nhelp: leave it at \"auto\"")]
    Instructions {
        /// What was asked for.
        wanted: InstructionSet,
        /// What there is.
        available: Vec<InstructionSet>,
    },
    /// The compute threads could not be started.
    #[error("cannot start {threads} compute threads: {source}\nhelp: ask for fewer with --threads")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// Why.
        source: rayon::ThreadPoolBuildError,
    },
}

/// How the process exits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitCode {
    /// Everything was done.
    Done = 0,
    /// The run failed; older outputs are untouched.
    Failed = 1,
    /// The command line or the settings cannot be used.
    Usage = 2,
    /// The outputs are complete but for tiles that failed, which `run.json` names.
    DoneWithLosses = 3,
    /// Ctrl-C or a termination signal.
    Interrupted = 130,
}

impl From<ValidateError> for Error {
    fn from(error: ValidateError) -> Error {
        Error::Validate(Box::new(error))
    }
}

impl<E: Into<Error>> From<Stopped<E>> for Error {
    fn from(stopped: Stopped<E>) -> Error {
        match stopped {
            Stopped::Interrupted => Error::Interrupted(Interrupted),
            Stopped::Collecting(error) => error.into(),
        }
    }
}

impl Error {
    /// The exit code that fits.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Error::Settings(_) | Error::Instructions { .. } | Error::Raster(_) | Error::Forecast(_) => ExitCode::Usage,
            Error::Resume(ResumeError::Changed { .. } | ResumeError::Finished { .. }) => ExitCode::Usage,
            Error::Open(open) if open.is_about_settings() => ExitCode::Usage,
            Error::Weld(WeldError::Tolerance { .. } | WeldError::Memory { .. }) => ExitCode::Usage,
            Error::Interrupted(_) => ExitCode::Interrupted,
            _ => ExitCode::Failed,
        }
    }
}
