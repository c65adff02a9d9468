//! Headers of text: NRRD and MetaImage, key by key in order.

/// Keys and values in their order.
#[derive(Clone)]
pub struct Header(pub Vec<(String, String)>);

impl Header {
    pub fn new(fields: &[(&str, &str)]) -> Header {
        let own = |(k, v): &(&str, &str)| (k.to_string(), v.to_string());
        Header(fields.iter().map(own).collect())
    }

    /// Replaces a key's value, or puts the key before the last.
    pub fn set(&mut self, key: &str, value: &str) -> &mut Header {
        match self.0.iter_mut().find(|(k, _)| k == key) {
            Some((_, v)) => *v = value.into(),
            None => {
                let at = self.0.len().saturating_sub(1);
                self.0.insert(at, (key.into(), value.into()));
            }
        }
        self
    }

    pub fn remove(&mut self, key: &str) -> &mut Header {
        self.0.retain(|(k, _)| k != key);
        self
    }

    pub fn nrrd(&self) -> Vec<u8> {
        let line = |(k, v): &(String, String)| match v.strip_prefix(":=") {
            Some(text) => format!("{k}:={text}\n"),
            None => format!("{k}: {v}\n"),
        };
        let lines: String = self.0.iter().map(line).collect();
        format!("NRRD0005\n{lines}\n").into_bytes()
    }

    pub fn metaimage(&self) -> Vec<u8> {
        let line = |(k, v): &(String, String)| format!("{k} = {v}\n");
        self.0.iter().map(line).collect::<String>().into_bytes()
    }
}
