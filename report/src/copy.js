// A button beside each command copies it; where the browser does not let it, the command is marked to be copied by hand.
document.querySelectorAll('.todo pre').forEach(function (pre) {
  var button = document.createElement('button');
  button.type = 'button';
  button.className = 'copy';
  button.textContent = 'copy';
  button.onclick = function () {
    var code = pre.querySelector('code');
    function said(word) {
      button.textContent = word;
      setTimeout(function () { button.textContent = 'copy'; }, 1500);
    }
    function byHand() {
      getSelection().selectAllChildren(code);
      said(document.execCommand('copy') ? 'copied' : 'marked');
    }
    if (navigator.clipboard) navigator.clipboard.writeText(code.textContent).then(function () { said('copied'); }, byHand);
    else byHand();
  };
  pre.append(button);
});
