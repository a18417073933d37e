!> Root and masses of a beam in words.
module body_words
   use body_settings, only: mass_settings_t, root_pinned, root_settings_t
   use kinds, only: wp
   use number_text, only: rounded
   use scene_types, only: beam_settings_t, shape_section
   use section_shapes, only: is_uniform, profile_names, profile_stepped, shape_names
   implicit none (type, external)
   private
   public :: section_in_words, root_in_words, mass_in_words

contains

   !> A section that is neither uniform nor a taper by &beam alone.
   pure function section_in_words(beam) result(words)
      type(beam_settings_t), intent(in) :: beam
      character(:), allocatable :: words

      words = 'section given by a table'
      if (beam%shape /= shape_section) return
      words = trim(shape_names(beam%section%shape))//' section, '
      if (is_uniform(beam%section)) then
         words = words//'uniform'
      else if (beam%section%profile == profile_stepped) then
         words = words//'in steps'
      else
         words = words//trim(profile_names(beam%section%profile))//' between stations'
      end if
   end function section_in_words

   !> What holds the root.
   pure function root_in_words(root) result(words)
      type(root_settings_t), intent(in) :: root
      character(:), allocatable :: words

      words = ''
      if (root%rotation_stiffness_ratio > 0.0_wp) then
         words = ', spring against rotation of '//rounded(root%rotation_stiffness_ratio)
      end if
      if (root%translation_stiffness_ratio > 0.0_wp) then
         words = words//', spring against displacement of '//rounded(root%translation_stiffness_ratio)
      end if
      if (words == '') words = ', clamped'
      if (root%kind == root_pinned) words = ', pinned'
      words = words(3:)
   end function root_in_words

   !> A mass on the beam.
   pure function mass_in_words(mass) result(words)
      type(mass_settings_t), intent(in) :: mass
      character(:), allocatable :: words

      words = rounded(mass%mass_ratio)//' of the beam'
      if (mass%rotary_inertia_ratio > 0.0_wp) words = words//', J = '//rounded(mass%rotary_inertia_ratio)
      words = words//', at x/L = '//rounded(mass%position)
   end function mass_in_words

end module body_words
