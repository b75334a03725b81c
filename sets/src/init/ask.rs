//! Questions, answered by an option, on a terminal, or by their default.

use super::error::InitError;
use std::io::{BufRead, Write};

/// A question.
pub struct Question<'a> {
    /// The option that answers it, without the dashes.
    pub option: &'a str,
    /// What is asked, in words.
    pub words: &'a str,
    /// Answers to choose from; none where anything may be said.
    pub choices: Vec<String>,
    /// The answer where the user gives none.
    pub default: Option<String>,
}

/// Who answers.
pub struct Asker<R, W> {
    answers: R,
    told: W,
    /// Whether somebody sits there.
    is_terminal: bool,
    /// Whether defaults are taken without asking.
    takes_defaults: bool,
    /// Options and answers so far, as a command line would say them.
    said: Vec<(String, String)>,
}

impl<R: BufRead, W: Write> Asker<R, W> {
    /// Asks on `told` and hears from `answers`, where these are a terminal; with `takes_defaults` only what has no default.
    pub fn new(answers: R, told: W, is_terminal: bool, takes_defaults: bool) -> Self {
        Asker { answers, told, is_terminal, takes_defaults, said: Vec::new() }
    }

    /// Whether defaults are taken without asking.
    pub fn takes_defaults(&self) -> bool {
        self.takes_defaults
    }

    /// Options that would give the same answers.
    pub fn said(&self) -> &[(String, String)] {
        &self.said
    }

    /// The answer to a question, as `read` understands it: `given` by an option, else said on the terminal, else the default.
    ///
    /// # Errors
    /// When an option's answer is not understood, and where nobody can be asked and there is none: usage, with the option's name.
    pub fn ask<T>(
        &mut self,
        question: &Question,
        given: Option<String>,
        mut read: impl FnMut(&str) -> Result<T, String>,
    ) -> Result<T, InitError> {
        if let Some(given) = given {
            let answer = read(&given).map_err(|why| usage(format!("--{} \"{given}\": {why}", question.option)))?;
            return Ok(self.heard(question, &given, answer));
        }
        let default = question.default.clone();
        if let Some(default) = default.filter(|_| self.takes_defaults) {
            let answer = read(&default).map_err(|why| usage(format!("--{}: its default \"{default}\": {why}", question.option)))?;
            return Ok(self.heard(question, &default, answer));
        }
        if !self.is_terminal {
            return Err(usage(unanswered(question)));
        }
        loop {
            let said = self.hear(question)?;
            match read(&said) {
                Ok(answer) => return Ok(self.heard(question, &said, answer)),
                Err(why) => self.tell(&format!("  {why}\n")),
            }
        }
    }

    fn heard<T>(&mut self, question: &Question, said: &str, answer: T) -> T {
        self.said.push((question.option.to_string(), said.to_string()));
        answer
    }

    /// One line of the terminal; an empty one is the default, and a number one of the choices.
    fn hear(&mut self, question: &Question) -> Result<String, InitError> {
        self.tell(&format!("\n{}\n", question.words));
        for (index, choice) in question.choices.iter().enumerate() {
            self.tell(&format!("  {}  {choice}\n", index + 1));
        }
        loop {
            let default = question.default.as_ref().map_or(String::new(), |d| format!("[{d}] "));
            self.tell(&format!("{default}> "));
            let mut line = String::new();
            match self.answers.read_line(&mut line) {
                Ok(0) => return Err(usage(format!("no more answers on standard input; {}", unanswered(question)))),
                Ok(_) => {}
                Err(e) => return Err(InitError::Machine(format!("standard input: cannot be read: {e}"))),
            }
            let line = line.trim();
            let numbered = || line.parse::<usize>().ok().and_then(|n| question.choices.get(n.checked_sub(1)?));
            let chosen = question.choices.iter().find(|choice| *choice == line).or_else(numbered);
            match (chosen, &question.default) {
                (Some(choice), _) => return Ok(choice.clone()),
                (None, Some(default)) if line.is_empty() => return Ok(default.clone()),
                (None, None) if line.is_empty() => self.tell("  there is no default here\n"),
                (None, _) => return Ok(line.to_string()),
            }
        }
    }

    /// Writes to the user at the terminal; where the terminal is gone the text is lost.
    fn tell(&mut self, text: &str) {
        let _ = self.told.write_all(text.as_bytes()).and_then(|()| self.told.flush());
    }
}

fn unanswered(question: &Question) -> String {
    let choices = if question.choices.is_empty() { String::new() } else { format!(" ({})", question.choices.join(", ")) };
    let or = question.default.as_ref().map_or(String::new(), |d| format!(", or accept the default, {d}, with --yes"));
    format!("give --{}: {}{choices}{or}", question.option, question.words)
}

/// A wrong or missing option.
pub(crate) fn usage(message: String) -> InitError {
    InitError::Usage(message)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn question() -> Question<'static> {
        let choices = vec!["translation".to_string(), "rotation".to_string()];
        Question { option: "motion", words: "How does it move?", choices, default: Some("translation".to_string()) }
    }

    fn asked(answers: &str, is_terminal: bool, takes_defaults: bool, given: Option<&str>) -> (Result<String, InitError>, String) {
        let mut told = Vec::new();
        let mut asker = Asker::new(answers.as_bytes(), &mut told, is_terminal, takes_defaults);
        let read = |text: &str| match text {
            "translation" | "rotation" => Ok(text.to_string()),
            other => Err(format!("\"{other}\" is no motion")),
        };
        let answer = asker.ask(&question(), given.map(str::to_string), read);
        (answer, String::from_utf8(told).unwrap())
    }

    #[test]
    fn a_terminal_answers_by_number_by_word_or_by_nothing() {
        for (said, meant) in [("2\n", "rotation"), ("rotation\n", "rotation"), ("\n", "translation"), ("3\nrotation\n", "rotation")] {
            let (answer, told) = asked(said, true, false, None);
            assert_eq!(answer.unwrap(), meant, "{told}");
            assert!(told.contains("How does it move?") && told.contains("2  rotation") && told.contains("[translation] > "), "{told}");
        }
        let (_, told) = asked("3\nrotation\n", true, false, None);
        assert!(told.contains("\"3\" is no motion"), "{told}");
        let ended = asked("", true, false, None).0.unwrap_err();
        let InitError::Usage(message) = &ended else { panic!("{ended}") };
        assert!(message.contains("no more answers") && message.contains("--motion"), "{message}");
    }

    #[test]
    fn without_a_terminal_an_option_or_a_wanted_default_answers() {
        assert_eq!(asked("", false, false, Some("rotation")).0.unwrap(), "rotation");
        assert_eq!(asked("", false, true, None).0.unwrap(), "translation");
        let missing = asked("", false, false, None).0.unwrap_err();
        let says = "give --motion: How does it move? (translation, rotation), or accept the default, translation, with --yes";
        assert!(matches!(&missing, InitError::Usage(message) if message == says), "{missing}");
        let wrong = asked("", false, false, Some("up")).0.unwrap_err();
        assert!(matches!(&wrong, InitError::Usage(message) if message == "--motion \"up\": \"up\" is no motion"), "{wrong}");
    }
}
