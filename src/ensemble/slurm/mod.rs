//! An ensemble as a job array of Slurm: scripts to read, to edit and to submit.

use minijinja::{Environment, context};

use crate::error::{Error, Result};
use crate::io::shell_word;

/// The scripts by name; `submit.sh` submits the other two.
const SCRIPTS: [(&str, &str); 3] = [
    ("array.sh", include_str!("array.sh.jinja")),
    ("merge.sh", include_str!("merge.sh.jinja")),
    ("submit.sh", include_str!("submit.sh.jinja")),
];

/// How often a task that was killed or stopped goes on.
const RESTARTS: u32 = 100;

/// A job array with a shard a task, and the merge that depends on it.
#[derive(Debug, Clone, PartialEq)]
pub struct SlurmJob {
    /// Name of the job.
    pub name: String,
    /// Number of shards.
    pub shards: u64,
    /// Cores of a task.
    pub cpus: u64,
    /// Options of `sbatch`, such as `--partition=long`, for the tasks and for the merge.
    pub options: Vec<String>,
    /// The program and what it is started with, words of a shell each: a container's, perhaps.
    pub command: Vec<String>,
    /// Arguments of `haloray ensemble` beside the configuration, the shard and its folder.
    pub arguments: Vec<String>,
    /// Folder of the merged ensemble.
    pub output: String,
}

impl SlurmJob {
    /// The scripts, by name.
    ///
    /// # Errors
    /// An option of more than one line.
    pub fn scripts(&self) -> Result<Vec<(&'static str, String)>> {
        let words = self.options.iter().chain([&self.name]);
        if let Some(word) = words.into_iter().find(|word| word.contains(['\n', '\r'])) {
            return Err(Error::out_of_range("option of a job", format!("{word:?}"), "of one line"));
        }
        let in_shell =
            |words: &[String]| words.iter().map(|word| shell_word(word)).collect::<Vec<_>>().join(" ");
        let context = context! {
            name => &self.name,
            shards => self.shards,
            cpus => self.cpus,
            options => &self.options,
            command => in_shell(&self.command),
            arguments => in_shell(&self.arguments),
            output => shell_word(&self.output),
            restarts => RESTARTS,
        };
        let faulty = |error: minijinja::Error| Error::out_of_range("script", error, "made by its template");
        let script = |(name, template)| {
            let text = Environment::new().render_str(template, &context).map_err(faulty)?;
            Ok((name, text + "\n"))
        };
        SCRIPTS.into_iter().map(script).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job() -> SlurmJob {
        SlurmJob {
            name: "ensemble".into(),
            shards: 3,
            cpus: 2,
            options: vec!["--partition=long".into(), "--time=1:00:00".into()],
            command: vec!["echo".into(), "a user's; rm -rf x $HOME".into()],
            arguments: vec!["-n".into(), "7".into()],
            output: "/data/my ensemble".into(),
        }
    }

    #[test]
    fn scripts_are_ones_that_a_shell_reads_and_words_stay_words() {
        let folder = tempfile::tempdir().unwrap();
        let scripts = job().scripts().unwrap();
        for (name, text) in &scripts {
            std::fs::write(folder.path().join(name), text).unwrap();
            let checked = std::process::Command::new("bash").arg("-n").arg(folder.path().join(name)).status();
            assert!(checked.unwrap().success(), "{text}");
        }
        let run = |name: &str| {
            let mut shell = std::process::Command::new("bash");
            shell.arg(name).current_dir(&folder).env("SLURM_ARRAY_TASK_ID", "2");
            let output = shell.output().unwrap();
            assert!(output.status.success(), "{output:?}");
            String::from_utf8(output.stdout).unwrap()
        };
        let told = "a user's; rm -rf x $HOME";
        assert_eq!(run("merge.sh"), format!("{told} merge . -o /data/my ensemble\n"));
        let wanted = format!("{told} ensemble config.toml -n 7 --shard 2/3 -o 2 --threads 2 --quiet\n");
        assert_eq!(run("array.sh"), wanted);
        std::fs::create_dir(folder.path().join("2")).unwrap();
        std::fs::write(folder.path().join("2/sightlines.h5"), "a shard that has ended").unwrap();
        assert_eq!(run("array.sh"), "");
        assert!(
            scripts[0].1.contains("\n#SBATCH --partition=long\n#SBATCH --time=1:00:00\n\n"),
            "{}",
            scripts[0].1
        );
    }

    #[test]
    fn a_task_that_is_killed_is_queued_again_and_one_that_fails_is_not() {
        let folder = tempfile::tempdir().unwrap();
        // Stands for Slurm's own.
        let scontrol = folder.path().join("scontrol");
        std::fs::write(&scontrol, "#!/bin/sh\necho \"$@\"\n").unwrap();
        let made_executable = std::process::Command::new("chmod").arg("+x").arg(&scontrol).status().unwrap();
        assert!(made_executable.success());
        let path = format!("{}:{}", folder.path().display(), std::env::var("PATH").unwrap());
        for (ends, restarts, told) in
            [("kill -9 $$", "0", "requeue 44_1\n"), ("kill -9 $$", "100", ""), ("exit 2", "0", "")]
        {
            let command = ["sh", "-c", ends].map(String::from).to_vec();
            let script = SlurmJob { command, ..job() }.scripts().unwrap().swap_remove(0).1;
            let mut shell = std::process::Command::new("bash");
            shell.arg("-c").arg(script).current_dir(&folder).env("PATH", &path);
            shell.envs([
                ("SLURM_ARRAY_TASK_ID", "1"),
                ("SLURM_ARRAY_JOB_ID", "44"),
                ("SLURM_RESTART_COUNT", restarts),
            ]);
            let output = shell.output().unwrap();
            assert_eq!(String::from_utf8(output.stdout).unwrap(), told, "{ends}");
            assert!(!output.status.success());
        }
    }

    #[test]
    fn an_option_of_two_lines_is_refused() {
        let options = vec!["--partition=a\n#SBATCH --uid=0".to_string()];
        assert!(SlurmJob { options, ..job() }.scripts().unwrap_err().is_bad_input());
    }
}
