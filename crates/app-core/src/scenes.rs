//! The scenes of a coordinator: `--scene` may be repeated, and every other argument is for all of them.

use clap::{ArgAction, ArgMatches, Args, Command, FromArgMatches};
use coordinator::{SceneOffer, SceneOffers};
use planner::Budget;
use scene::{Scene, SceneSpec};

use crate::exit::BadInput;
use crate::quality::QualityArgs;
use crate::setup::{SceneArgs, Setup};

/// The arguments of [`SceneArgs`], for one scene or several.
#[derive(Debug, Clone)]
pub struct ScenesArgs {
    /// In the order of the command line; sessions that name no scene get the first.
    scenes: Vec<SceneSpec>,
    /// The arguments of the first scene, which are those of every scene but for its name.
    first: SceneArgs,
}

impl ScenesArgs {
    /// Checks that the arguments leave a budget its choices.
    ///
    /// # Errors
    /// They name what a budget chooses, or samples that it cannot choose.
    pub fn check_for_budget(&self, budget: Budget) -> Result<(), BadInput> {
        self.first.check_for_budget(budget)
    }

    /// Loads all scenes, and places sample cameras in each.
    ///
    /// # Errors
    /// A scene cannot be used, or is given twice.
    pub fn load(&self) -> anyhow::Result<(Vec<Scene>, SceneOffers)> {
        let mut scenes = Vec::with_capacity(self.scenes.len());
        let mut offers = Vec::with_capacity(self.scenes.len());
        for scene in &self.scenes {
            let args = SceneArgs { scene: scene.clone(), ..self.first.clone() };
            let Setup { scene, mut offer, .. } = args.load()?;
            offer.settings.method = args.offered_method().map(|method| method.to_string());
            scenes.push(scene);
            offers.push(offer);
        }
        number_equal_names(&mut offers);
        Ok((scenes, SceneOffers::new(offers).map_err(|error| BadInput(error.to_string()))?))
    }
}

/// Files of one name in different folders are told apart: `scene`, `scene-2`.
fn number_equal_names(offers: &mut [SceneOffer]) {
    for place in 1..offers.len() {
        let (before, rest) = offers.split_at_mut(place);
        let own = rest[0].name.clone();
        let names = std::iter::once(own.clone()).chain((2..).map(|number| format!("{own}-{number}")));
        let mut free = names.filter(|name| before.iter().all(|other| other.name != *name));
        rest[0].name = free.next().unwrap_or(own);
    }
}

impl Args for ScenesArgs {
    fn augment_args(command: Command) -> Command {
        let command = SceneArgs::augment_args(command).mut_arg("scene", |scene| scene.action(ArgAction::Append));
        QualityArgs::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for ScenesArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let scenes = matches.get_many("scene").into_iter().flatten().cloned().collect();
        // One value is taken here: the first.
        let first = SceneArgs::from_arg_matches(matches)?;
        let of_quality = QualityArgs::from_arg_matches(matches)?.method();
        Ok(Self { scenes, first: SceneArgs { method: first.method.or(of_quality), ..first } })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
