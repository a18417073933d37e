!> The group of the frequency response of the linear beam in a results file.
module linear_groups
   use kinds, only: wp
   use quantity_groups, only: quantity_group_t
   use response_types, only: frequency_response_t
   implicit none (type, external)
   private
   public :: write_frequency_response

contains

   subroutine write_frequency_response(group, answer)
      type(quantity_group_t), intent(in) :: group
      type(frequency_response_t), intent(in) :: answer

      character(*), parameter :: at_stops(2) = [character(7) :: 'surface', 'omega']
      integer :: k

      call group%attribute('meaning', 'displacements, relative to the base, of the beam with its stops open: ' &
         //'amplitude times sin(omega t + phase), where loads have their amplitudes and phases, all at omega')
      call group%put('omega', answer%frequency, 'frequency', '{omega over omega1~frequency of the loads}', &
         is_scale=.true.)
      call group%put('amplitude_tip', abs(answer%tip), 'displacement', 'amplitude of the tip', 'omega')
      call group%put('phase_tip', degrees(answer%tip), 'number', 'its phase in degrees', 'omega')
      if (size(answer%stop, 1) == 0) return
      call group%put('surface', [(k, k=1, size(answer%stop, 1))], &
         'surface, in the order of &stop, below before above', is_scale=.true.)
      call group%put('amplitude_stop', abs(answer%stop), 'displacement', 'amplitude of the beam there', at_stops)
      call group%put('phase_stop', degrees(answer%stop), 'number', 'its phase in degrees', at_stops)
   end subroutine write_frequency_response

   !> Phase; of nothing it is 0.
   elemental function degrees(amplitude) result(phase)
      complex(wp), intent(in) :: amplitude
      real(wp) :: phase

      phase = atan2(aimag(amplitude), real(amplitude, wp))*(180.0_wp/acos(-1.0_wp))
   end function degrees

end module linear_groups
